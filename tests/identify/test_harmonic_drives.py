"""The laws, the drive and the named models of the pan-and-tilt, against formulas and solvers."""

from pathlib import Path

from every_effect import inputs, parameters
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.drives import CurrentAmplifier, CurrentDrive
from servo_twin.physics.harmonic_drive_models import HARMONIC_DRIVES, NAMES, with_harmonic_drive
from servo_twin.physics.mechanisms.ball_screw import BallScrew
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.ports import Teeth, WindUp
from servo_twin.physics.servo import Placed, Servo, ServoError
from servo_twin.physics.simulate import initial_state, simulate
from servo_twin.physics.state import (
    LOAD_ANGLE,
    LOAD_SPEED,
    MOTOR_ANGLE,
    MOTOR_SPEED,
    ZERO,
)

SERVOS = Path(__file__).parents[2] / 'config' / 'servos'
AZIMUTH = servo_file.load(SERVOS / 'pan_tilt_azimuth.yaml')


def teeth(motor: float) -> Teeth:
    return Teeth(motor, 0.0, 1.0, 0.0, 0.0, motor)


# --- the laws


def test_the_slope_of_the_kinematic_error_is_its_derivative():
    effect = find('kinematic_error')
    p = parameters(effect, cosine=(1e-4, -3e-5, 2e-5), sine=(2e-5, 5e-5, 0.0), order=2.0)
    step = 1e-5
    for motor in np.linspace(-4.0, 4.0, 23):
        by_difference = (effect.law(p, (), teeth(motor + step), 0.0)
                         - effect.law(p, (), teeth(motor - step), 0.0)) / (2.0 * step)
        assert effect.motor_slope(p, teeth(motor)) == pytest.approx(by_difference, rel=1e-6,
                                                                    abs=1e-9)


def test_the_stiffening_spring_is_stiffer_in_proportion_to_its_wind_up():
    law = find('stiffening_spring').law
    p = parameters(find('stiffening_spring'), rise=50.0)
    angles = np.linspace(-0.2, 0.2, 4001)
    torque = [law(p, (), WindUp(a, 0.0, 0.0), 0.0) for a in angles]
    stiffness = np.gradient(torque, angles)
    assert stiffness[1:-1] == pytest.approx(2.0 * 50.0 * np.abs(angles[1:-1]), abs=1e-2)
    assert law(p, (), WindUp(-0.1, 0.0, 0.0), 0.0) == -law(p, (), WindUp(0.1, 0.0, 0.0), 0.0)


def test_the_dissipation_is_damping_when_slow_and_a_loop_of_fixed_height_when_fast():
    effect = find('dissipative_hysteresis')
    p = parameters(effect, level=2.0, rate=0.01, reach=1e-3)

    def at(angle, rate):
        return effect.law(p, (), WindUp(angle, rate, 0.0), 0.0)

    assert at(0.0, 1e-6) == pytest.approx(2.0 * 1e-6 / 0.01, rel=1e-6)
    assert at(0.0, 10.0) == pytest.approx(2.0, rel=1e-5)
    assert at(1e-3, 1e-6) == pytest.approx(at(0.0, 1e-6) / np.sqrt(2.0), rel=1e-6)
    assert at(0.0, 0.0) == 0.0 and at(1e-3, -0.02) == -at(1e-3, 0.02)


# --- the reaction of an error on the motor


def test_a_kinematic_error_makes_no_energy():
    """Two free shafts on a lossless mesh that errs: what they have together stays."""
    error = Placed('error', find('kinematic_error'), 'mesh')
    servo = Servo('free', CurrentDrive, TwoInertia, effects=(error,), step=2e-6, values={
        'mechanism.rotor_inertia': 2e-5, 'mechanism.load_inertia': 0.5, 'mechanism.ratio': 100.0,
        'mechanism.stiffness': 1e4, 'mechanism.damping': 0.0, 'effects.error.order': 2.0,
        'effects.error.cosine': (3e-4,), 'effects.error.sine': (1e-4,)})
    x = initial_state(servo, 0.0, 0.0, 1.0)
    x[MOTOR_SPEED], x[LOAD_SPEED] = 120.0, 1.2  # near resonance of twice a turn
    energies, torques = [], []
    for _ in range(300):
        wind_up = (x[MOTOR_ANGLE] / 100.0 - x[LOAD_ANGLE] - x[ZERO]
                   - 3e-4 * np.cos(2.0 * x[MOTOR_ANGLE]) - 1e-4 * np.sin(2.0 * x[MOTOR_ANGLE]))
        energies.append(0.5 * (2e-5 * x[MOTOR_SPEED]**2 + 0.5 * x[LOAD_SPEED]**2
                               + 1e4 * wind_up**2))
        torques.append(1e4 * wind_up)
        simulate(servo, inputs(1), 1e-3, x)
    assert np.ptp(torques) > 4.0, 'the error does not shake the mesh'
    assert np.ptp(energies) < 1e-3 * np.ptp(torques)**2 / 1e4 + 2e-4 * energies[0]


# --- the amplifier


def test_the_amplifier_and_its_winding_are_those_of_equation_1():
    """Against an implicit solver of eq. 1 with both limits, the rotor held at a speed."""
    values = {'drive.gain': 0.3, 'drive.current_limit': 2.0, 'drive.proportional': 20.0,
              'drive.supply': 9.0, 'drive.resistance': 4.0, 'drive.inductance': 4e-3,
              'drive.back_emf': 0.05}
    p = parameters(CurrentAmplifier, **{k[6:]: v for k, v in values.items()})
    for command, speed in ((5.0, 0.0), (10.0, 0.0), (-4.0, 100.0), (8.0, 150.0)):
        def slope(t, i, command=command, speed=speed):
            wanted = np.clip(0.3 * command, -2.0, 2.0)
            volts = np.clip(20.0 * (wanted - i), -9.0, 9.0)
            return (volts - 4.0 * i - 0.05 * speed) / 4e-3

        expected = solve_ivp(slope, (0.0, 4e-3), [0.0], method='LSODA', rtol=1e-9, atol=1e-10,
                             t_eval=np.linspace(0.0, 4e-3, 41), max_step=1e-5).y[0]
        current, found = 0.0, [0.0]
        for k in range(4000):
            current = CurrentAmplifier.law(p, current, command, speed, 1e-6)
            if k % 100 == 99:
                found.append(current)
        assert found == pytest.approx(expected, abs=2e-3)


def test_an_amplifier_of_any_gain_and_no_inductance_is_stable():
    p = parameters(CurrentAmplifier, proportional=1e6, inductance=0.0, gain=0.2, supply=1e3)
    assert CurrentAmplifier.law(p, 0.7, 5.0, 10.0, 1e-4) == pytest.approx(1.0, rel=1e-4)


# --- inertia that another axis changes


@pytest.mark.long
@pytest.mark.slow
def test_a_load_whose_inertia_changes_keeps_its_angular_momentum():
    payload = Placed('payload', find('coupled_inertia'), 'load')
    mesh = {'mechanism.stiffness': 200.0, 'mechanism.damping': 2.0}
    for mechanism, more in ((TwoInertia, mesh), (Rigid, {})):
        servo = Servo('turning', CurrentDrive, mechanism, effects=(payload,), step=1e-4, values={
            'mechanism.rotor_inertia': 0.05, 'mechanism.load_inertia': 0.35, **more,
            'mechanism.ratio': 1.0, 'effects.payload.cosine': 0.3, 'effects.payload.sine': 0.1})
        x = initial_state(servo)
        x[MOTOR_SPEED] = x[LOAD_SPEED] = 1.0
        tilt = np.linspace(0.0, 1.2, 500)
        y = simulate(servo, inputs(500, coupled_position=tilt), 1e-3, x)
        inertia = 0.4 + np.hypot(0.3, 0.1) + 0.3 * np.cos(2.0 * tilt) + 0.1 * np.sin(2.0 * tilt)
        speed = np.gradient(y[:, 1], 1e-3)
        assert speed[20:-2] == pytest.approx((inertia[0] / inertia)[20:-2], rel=2e-2)
        late = slice(400, -2)
        momentum = np.mean(speed[late] * inertia[late]) / inertia[0]
        assert momentum == pytest.approx(1.0, rel=3e-3)


@pytest.mark.slow
def test_a_pan_is_slower_to_turn_with_its_tilt_level():
    answers = [simulate(AZIMUTH, inputs(300, voltage=8.0, coupled_position=tilt), 1e-3,
                        initial_state(AZIMUTH))[-1, 1] for tilt in (0.0, 1.4)]
    assert answers[0] < 0.75 * answers[1]


def test_a_mechanism_that_does_not_mind_an_inertia_refuses_one():
    with pytest.raises(ServoError, match=r'needs a mechanism that minds it.*two_inertia'):
        Servo('s', CurrentDrive, BallScrew, effects=(
            Placed('payload', find('coupled_inertia'), 'load'),))


# --- models by name


@pytest.mark.parametrize('name', HARMONIC_DRIVES)
def test_a_servo_file_takes_a_model_by_name(name):
    text = (SERVOS / 'pan_tilt_azimuth.yaml').read_text()
    servo = servo_file.loads(text.replace('model: taghirad', f'model: {name}'))
    model = HARMONIC_DRIVES[name]
    assert [p.name for p in servo.effects if p.name in NAMES] == [m.name for m in model.members]
    for member in model.members:
        assert member.effect == next(p for p in servo.effects
                                     if p.name == member.name).effect.name
        for parameter, value in member.values.items():
            assert servo.values[f'effects.{member.name}.{parameter}'] == value
    assert servo_file.loads(servo_file.dumps(servo)) == servo
    again = with_harmonic_drive(AZIMUTH, name)
    assert {p.name: p for p in again.effects} == {p.name: p for p in servo.effects}


def test_a_servo_file_may_give_the_values_of_a_model():
    text = (SERVOS / 'pan_tilt_azimuth.yaml').read_text().replace(
        'model: taghirad', "model: taghirad\n  gear_mesh: {share: {value: 0.2, source: 'ours'}}")
    servo = servo_file.loads(text)
    assert servo.values['effects.gear_mesh.share'] == 0.2
    assert servo.provenance['effects.gear_mesh.share'].source == 'ours'


@pytest.mark.parametrize('section, words', [
    ('model: spring', "there is no 'spring'; there are .*'tjahjowidodo'"),
    ('model: taghirad\n  loop: {level: 1.0}', "harmonic_drive of taghirad: there is no 'loop'"),
    ('model: taghirad\n  gear_mesh: {level: 1.0}', "has no parameter 'level'"),
    ('{}', None)])
def test_a_model_that_is_none_is_named(section, words):
    text = (SERVOS / 'pan_tilt_azimuth.yaml').read_text().replace(
        'harmonic_drive:\n  model: taghirad', f'harmonic_drive:\n  {section}')
    if words is None:
        assert not NAMES.intersection(p.name for p in servo_file.loads(text).effects)
        return
    with pytest.raises(ServoError, match=words):
        servo_file.loads(text)


@pytest.mark.long
def test_the_linear_model_has_no_plateau_and_the_models_with_friction_have_one():
    """The finding of the paper's figures 10 and 11, on the twin alone."""
    t = np.arange(6000) * 1e-3
    u = inputs(len(t), voltage=3.0 * np.sin(2.0 * np.pi * 0.25 * t))
    rests = {}
    for name in (None, 'taghirad'):
        servo = with_harmonic_drive(AZIMUTH, name)
        speed = np.gradient(simulate(servo, u, 1e-3, initial_state(servo))[:, 1], 1e-3)
        rests[name] = np.mean(np.abs(speed) < 1e-3)
    assert rests[None] < 0.01 and rests['taghirad'] > 0.05
