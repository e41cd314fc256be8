"""Laws that steepen with speed, current or torsion are judged as far as the file's limits go."""

from __future__ import annotations

from dataclasses import replace

from every_effect import inputs
from hypothesis import assume, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from servo_twin.physics.catalogue import find
from servo_twin.physics.controllers import Cascade, Impedance, Open, VelocityPi
from servo_twin.physics.drives import CurrentAmplifier, CurrentDrive, VoltageDrive
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.servo import Placed, Servo, ServoError
from servo_twin.physics.simulate import initial_state, simulate
from servo_twin.physics.state import LOAD_SPEED, MOTOR_SPEED
from servo_twin.physics.step_limit import check_step, longest_step

DRIVE = {'drive.gain': 1.0, 'drive.torque_constant': 1.0, 'mechanism.ratio': 1.0}
PI = {'controller.kp': 1.0, 'controller.ki': 0.0}


def rigid(effect, site, values, limit=5.0, inertia=0.01, drive=CurrentDrive, controller=VelocityPi,
          **more):
    """Return one inertia with an effect, whose controller limits the command, V."""
    placed = Placed('own', find(effect), site)
    given = {'controller.limit': limit, **PI} if controller is VelocityPi else {}
    return Servo('one', drive, Rigid, controller, (), (placed,), {
        **DRIVE, 'mechanism.rotor_inertia': inertia, 'mechanism.load_inertia': 0.0, **given,
        **{name.replace('__', '.'): value for name, value in more.items()},
        **placed.paths(values)}, step=1e-7)


def two(effect, values, limit=5.0, controller=VelocityPi, **more):
    """Return two inertias of 0.02 and 0.05 kg m2 with an effect in their mesh of 200 N m/rad."""
    placed = Placed('own', find(effect), 'mesh')
    given = {'controller.limit': limit, **PI} if controller is VelocityPi else {}
    return Servo('two', CurrentDrive, TwoInertia, controller, (), (placed,), {
        **DRIVE, 'mechanism.rotor_inertia': 0.02, 'mechanism.load_inertia': 0.05,
        'mechanism.stiffness': 200.0, 'mechanism.damping': 0.0, **given,
        **{name.replace('__', '.'): value for name, value in more.items()},
        **placed.paths(values)}, step=1e-7)


def of_two(stiffness, lever=1.0):
    return 2.0 / np.sqrt(stiffness * (lever**2 / 0.02 + 1.0 / 0.05))


def run(servo, h, volts, steps=4000, x=None):
    """Return angles of motor and load and the torque under a constant command, (steps, 3)."""
    x = initial_state(servo, 0.0, 0.0) if x is None else x
    return simulate(replace(servo, step=h), inputs(steps, voltage=volts), h, x)[:, :3]


def is_refused_at(servo, step):
    try:
        check_step(replace(servo, step=step))
    except ServoError:
        return True
    return False


@pytest.mark.parametrize(('rise', 'volts'), [(1.0, 5.0), (0.05, 0.5), (300.0, 40.0)])
def test_drag_by_the_square_of_the_speed_is_judged_where_the_drive_goes_no_faster(rise, volts):
    servo = rigid('quadratic_drag', 'motor', {'rise': rise}, limit=volts)
    limit, fastest = 0.01 / (2.0 * np.sqrt(rise * volts)), np.sqrt(volts / rise)
    assert longest_step(servo) == pytest.approx(limit, rel=0.01)
    assert is_refused_at(servo, 2.0 * limit)
    for share, settles in ((0.97, True), (2.2, False)):
        speed = np.diff(run(servo, share * limit, volts)[:, 0]) / (share * limit)
        assert speed.max() <= fastest * (1.0 + 1e-6) or not settles
        assert (np.ptp(speed[-100:]) < 1e-6 * fastest) == settles


@pytest.mark.parametrize(('drive', 'controller', 'more', 'fastest'), [
    (VoltageDrive, VelocityPi, {'drive__resistance': 0.5, 'drive__back_emf': 2.5}, 1.5311),
    (CurrentDrive, Cascade, {'controller__kp': 1.0, 'controller__kv': 1.0,
                             'controller__speed_limit': 3.0}, 3.0),
    (CurrentDrive, Impedance, {'controller__kp': 1.0, 'controller__kd': 1.0,
                               'controller__command_torque': 1.0,
                               'controller__torque_limit': 4.0}, 2.0),
    (CurrentAmplifier, Open, {'drive__current_limit': 4.0, 'drive__supply': 1e3,
                              'drive__back_emf': 0.0, 'drive__resistance': 1.0,
                              'drive__inductance': 0.0, 'drive__proportional': 1e6}, 2.0)],
    ids=['back-EMF', 'speed limit', 'torque limit', 'current limit'])
def test_each_limit_of_drive_and_controller_bounds_the_speed_of_drag(drive, controller, more,
                                                                     fastest):
    servo = rigid('quadratic_drag', 'motor', {'rise': 1.0}, drive=drive, controller=controller,
                  **more)
    assert longest_step(servo) == pytest.approx(0.01 / (2.0 * fastest), rel=0.02)


def test_drag_is_judged_at_rest_where_nothing_limits_the_drive():
    assert longest_step(rigid('quadratic_drag', 'motor', {'rise': 1.0}, controller=Open)) > 1e2


def test_a_limit_among_the_effects_bounds_the_drive_as_well():
    limit = Placed('limit', find('current_limit'), 'current')
    servo = rigid('quadratic_drag', 'motor', {'rise': 1.0}, controller=Open)
    servo = servo.with_effects(limit, values={'effects.limit.share': 1.0,
                                              'effects.limit.limit': 4.0})
    assert longest_step(servo) == pytest.approx(0.01 / 4.0, rel=0.01)


@pytest.mark.parametrize('controller', [VelocityPi, Open])
@pytest.mark.parametrize('critical', [1e-6, 1e-3, 10.0])
def test_a_brake_that_falls_beyond_its_peak_is_judged_by_its_rise_before(critical, controller):
    servo = rigid('eddy_brake', 'motor', {'peak': 0.3, 'speed': critical}, controller=controller)
    limit = 0.01 * critical / 0.6
    assert longest_step(servo) == pytest.approx(limit, rel=0.02)
    assert is_refused_at(servo, 2.0 * limit)


def test_friction_over_speed_is_judged_at_the_steepest_place_of_its_curve():
    steep = [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0]
    servo = rigid('friction_over_speed', 'motor', {'low': 0.0, 'high': 7.0, 'curve': steep})
    assert longest_step(servo) == pytest.approx(0.01, rel=0.01)  # 1 N m for 1 rad/s


def grows(servo, h, volts=0.0, at=0.0):
    """Whether a swing of a millionth about an angle of the motor is larger in the end."""
    x = initial_state(servo, at, at)
    x[MOTOR_SPEED], x[LOAD_SPEED] = 1e-6, -3e-7
    y = run(servo, h, volts, x=x)
    moved = np.abs(np.diff(y, axis=0))
    early, late = moved[:3].max(axis=0), moved[-500:].max(axis=0)
    return not np.isfinite(y).all() or (late > 100.0 * early + 1e-9).any()


RAMP = tuple(float(k - 1) for k in range(9))
ORDER = 24.0


@pytest.mark.parametrize(('servo', 'limit', 'volts', 'at'), [
    (two('stiffness_ripple', {'order': 30.0, 'cosine': (100.0,), 'sine': (0.0,)}),
     of_two(300.0), 0.0, 0.0),
    (two('one_sided_stiffness', {'difference': 100.0}), of_two(300.0), None, 0.0),
    (two('kinematic_error', {'order': 2.0, 'cosine': (0.0,), 'sine': (-0.1,)}, limit=1e-9),
     of_two(200.0, 1.2), 0.0, 0.0),
    (two('elasticity_over_torsion', {'low': 0.0, 'high': 0.6, 'curve': tuple(
        10.0 * one for one in RAMP)}), of_two(300.0), 0.0, 0.0),
    (rigid('torque_over_angle', 'motor', {'low': 0.0, 'high': 6.0, 'curve': tuple(
        -40.0 * one for one in RAMP)}), 2.0 / np.sqrt(40.0 / 0.01), 80.0, 2.0),
    (rigid('torque_ripple', 'motor', {'order': ORDER, 'cosine': (0.0,), 'sine': (-0.3,)},
           drive__torque_constant=1e-9), 2.0 / np.sqrt(5.0 * 0.3 * ORDER / 0.01), 5.0, 0.0)],
    ids=['ripple', 'one side', 'error', 'torsion', 'angle', 'current'])
def test_a_law_is_a_spring_where_it_is_steepest(servo, limit, volts, at):
    assert longest_step(servo) == pytest.approx(limit, rel=0.02)
    assert is_refused_at(servo, 2.0 * limit)
    if volts is not None:
        assert not grows(servo, 0.96 * limit, volts, at)
        assert grows(servo, 1.04 * limit, volts, at)


def test_a_transmission_that_hardens_is_judged_at_the_torque_of_its_drive():
    cubic, torque = 1e4, 50.0
    servo = two('nonlinear_stiffness', {'cubic': cubic, 'soft': 0.0}, limit=torque)
    torsion = next(r.real for r in np.roots([cubic, 0.0, 200.0, -torque]) if abs(r.imag) < 1e-9)
    assert longest_step(servo) == pytest.approx(of_two(200.0 + 3.0 * cubic * torsion**2), rel=0.01)
    free = two('nonlinear_stiffness', {'cubic': cubic, 'soft': 0.0}, controller=Open)
    assert longest_step(free) == pytest.approx(of_two(200.0), rel=1e-3)


def test_what_a_transmission_is_softer_by_at_rest_comes_back_at_the_torque_of_its_drive():
    servo = two('nonlinear_stiffness', {'soft': 150.0, 'reach': 1e-3})
    assert longest_step(servo) == pytest.approx(of_two(200.0), rel=0.01)


def test_more_torque_for_a_current_makes_more_of_the_back_emf():
    def servo(constant, slope):
        return rigid('torque_over_current', 'motor', {
            'low': 0.0, 'high': 6.0, 'curve': tuple(slope * one for one in RAMP)},
            drive=VoltageDrive, drive__resistance=0.1, drive__back_emf=1.0,
            drive__torque_constant=constant)
    assert longest_step(servo(1.0, 2.0)) == pytest.approx(longest_step(servo(3.0, 0.0)), rel=1e-3)


def test_a_refusal_says_for_which_current_the_machine_was_judged():
    servo = rigid('quadratic_drag', 'motor', {'rise': 1.0})
    with pytest.raises(ServoError, match='at up to 5 A, which the limits of drive and controller'):
        check_step(replace(servo, step=0.1))


LAWS = {
    'quadratic_drag': {'rise': st.floats(1e-4, 1e3)},
    'eddy_brake': {'peak': st.floats(0.01, 50.0), 'speed': st.floats(1e-3, 100.0)},
    'torque_ripple': {'order': st.floats(1.0, 100.0), 'cosine': st.floats(-0.9, 0.9),
                      'sine': st.floats(-0.9, 0.9)},
    'stiffness_ripple': {'order': st.floats(1.0, 100.0), 'cosine': st.floats(-60.0, 60.0),
                         'sine': st.floats(-60.0, 60.0)},
    'nonlinear_stiffness': {'cubic': st.floats(0.0, 1e6), 'soft': st.floats(0.0, 150.0),
                            'reach': st.floats(1e-3, 1.0)},
    'kinematic_error': {'order': st.floats(1.0, 4.0), 'cosine': st.floats(-0.05, 0.05),
                        'sine': st.floats(-0.05, 0.05)},
}


@pytest.mark.long
@settings(max_examples=60)
@given(name=st.sampled_from(sorted(LAWS)), data=st.data(), volts=st.floats(0.1, 50.0))
def test_what_moves_at_the_limit_is_bounded_and_twice_as_long_a_step_is_refused(name, data, volts):
    values = {one: data.draw(within) for one, within in LAWS[name].items()}
    values = {one: (value,) if one in ('cosine', 'sine') else value
              for one, value in values.items()}
    motor = find(name).port in ('torque', 'friction')
    servo = (rigid(name, 'motor', values, volts) if motor else two(name, values, volts))
    limit = longest_step(servo)
    assume(np.isfinite(limit) and 1e-7 <= limit <= 0.04)
    assert not is_refused_at(servo, 0.999 * limit) and is_refused_at(servo, 2.0 * limit)
    # pushed this way for an eighth, let go for the rest: the swing that is left does not grow
    steps, h = 4000, 0.5 * limit
    # (a rippled stiffness gains from a load that turns, at any step: it is hardly pushed)
    push = 1e-9 * volts if name == 'stiffness_ripple' else volts
    u = inputs(steps, voltage=np.where(np.arange(steps) < steps // 8, push, 0.0))
    y = simulate(replace(servo, step=h), u, h, initial_state(servo, 0.0, 0.0))[:, :3]
    assert np.isfinite(y).all()
    speed = np.abs(np.diff(y[:, 0])) / h
    assert speed[-steps // 2:].max() <= 1.5 * speed[:steps // 2].max() + 1e-12
