"""A step too long for the springs of its machine is refused, with the step that would do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import re

from every_effect import inputs
from hypothesis import assume, given, settings
from hypothesis import strategies as st
import numpy as np
from plain_machines import UNIT_DRIVE
import pytest
import yaml

from servo_twin.description.servo_file import load, loads
from servo_twin.physics.catalogue import find
from servo_twin.physics.drives import CurrentDrive, VoltageDrive
from servo_twin.physics.mechanisms.ball_screw import BallScrew
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.servo import Placed, Servo, ServoError
from servo_twin.physics.simulate import initial_state, simulate
from servo_twin.physics.state import LOAD_SPEED, MOTOR_SPEED
from servo_twin.physics.step_limit import check_step, longest_step

CONFIG = Path(__file__).resolve().parents[2] / 'config'
EXTRA = (Placed('softer', find('nonlinear_stiffness'), 'mesh'),
         Placed('spring', find('spring_load'), 'load'),
         Placed('creeping', find('viscoelasticity'), 'mesh'),
         Placed('contacts', find('presliding_friction'), 'load'),
         Placed('payload', find('payload_resonance'), 'load'))
OFF = {f'effects.{p.name}.{a}': p.effect.parameters[a].off
       for p in EXTRA for a in p.effect.amplitudes()}


def swing(servo, h, steps=5_000):
    """Return how large a machine's swing is in the end, against the largest at its beginning."""
    x = initial_state(servo, 0.0, 0.0)
    x[MOTOR_SPEED], x[LOAD_SPEED] = 1e-6 * servo.values['mechanism.ratio'], -3e-7
    y = simulate(Servo(servo.name, servo.drive, servo.mechanism, servo.controller, (),
                       servo.effects, servo.values, step=h),
                 inputs(steps), h, x)[:, :3]
    if not np.isfinite(y).all():
        return np.inf
    moved = np.abs(np.diff(y - y.mean(axis=0), axis=0))
    early, late = moved[:20].max(axis=0), moved[-500:].max(axis=0)
    return float((late / np.maximum(early, 1e-30)).max())


def machine(stiffness=200.0, damping=0.0, drive=CurrentDrive, **values):
    given = {k.replace('__', '.'): v for k, v in values.items()}
    return Servo('two', drive, TwoInertia, effects=EXTRA, values={
        **({} if drive is VoltageDrive else UNIT_DRIVE), 'mechanism.ratio': 1.0,
        'mechanism.rotor_inertia': 0.02, 'mechanism.load_inertia': 0.05,
        'mechanism.stiffness': stiffness, 'mechanism.damping': damping, **OFF, **given}, step=1e-7)


@pytest.mark.parametrize('servo', [
    machine(), machine(damping=0.4), machine(damping=10.0),
    machine(effects__softer__soft=150.0, effects__softer__reach=10.0),
    machine(effects__spring__stiffness=5e3),
    machine(effects__creeping__stiffness=500.0, effects__creeping__time=100.0),
    machine(effects__contacts__level=50.0, effects__contacts__breakaway=1e-3,
            effects__contacts__lag=2e-3),
    machine(effects__payload__inertia=0.1, effects__payload__frequency=60.0,
            effects__payload__damping=0.0),
    machine(drive=VoltageDrive, drive__resistance=0.1, drive__back_emf=1.0,
            drive__torque_constant=1.0, drive__gain=1.0),
    machine(drive=VoltageDrive, drive__resistance=0.1, drive__inductance=1e-3,
            drive__back_emf=1.0, drive__torque_constant=1.0, drive__gain=1.0),
    Servo('screw', CurrentDrive, BallScrew, values={'mechanism.nut_place': 0.045}),
], ids=['springs', 'damped', 'overdamped', 'softer', 'held', 'creeping', 'contacts', 'payload',
        'winding', 'coil', 'screw'])
def test_the_compiled_step_gains_motion_just_beyond_the_limit_and_not_below(servo):
    limit = longest_step(servo)
    assert swing(servo, 0.97 * limit) < 30.0
    assert swing(servo, 1.03 * limit) > 1e3


def test_contacts_that_have_not_slipped_are_a_spring_and_a_damper():
    servo = machine(effects__contacts__level=50.0, effects__contacts__breakaway=1e-3,
                    effects__contacts__lag=0.0, stiffness=1.0)
    assert longest_step(servo) == pytest.approx(2.0 / np.sqrt(5e4 / 0.05), rel=0.01)


def test_a_loop_of_the_transmission_is_a_spring_before_it_slips():
    level, travel = 3.0, 1e-3
    loop = Placed('loop', find('hysteresis'), 'mesh')
    slipping = machine().with_effects(loop, values={
        'effects.loop.level': level, 'effects.loop.travel': travel})
    stiffer = 0.25 * level * sum(1.0 / (0.25 * (i + 1) * travel) for i in range(4))
    assert longest_step(slipping) == pytest.approx(longest_step(machine(200.0 + stiffer)))


def test_what_creeps_is_a_spring_before_it_does():
    creeping = machine(effects__creeping__stiffness=500.0, effects__creeping__time=100.0)
    assert longest_step(creeping) == pytest.approx(longest_step(machine(700.0)), rel=1e-3)


def test_two_masses_bear_two_over_their_highest_frequency():
    assert longest_step(machine()) == pytest.approx(
        2.0 / np.sqrt(200.0 * (1.0 / 0.02 + 1.0 / 0.05)), rel=1e-6)


def test_what_has_no_spring_bears_any_step():
    assert longest_step(Servo('rigid', CurrentDrive, Rigid)) == np.inf


def test_a_pendulum_that_falls_is_no_step_too_long():
    falling = Servo('pendulum', CurrentDrive, Rigid, effects=(
        Placed('gravity', find('gravity'), 'load'),), values={
        'effects.gravity.sine': 50.0, 'effects.gravity.cosine': 3.0}, step=1e-2)
    check_step(falling)


@pytest.mark.parametrize('path', sorted((CONFIG / 'servos').glob('*.yaml')), ids=lambda p: p.stem)
def test_each_shipped_file_keeps_well_below(path):
    servo = load(path)
    assert servo.step <= longest_step(servo) / 4.0


def test_a_file_is_refused_with_the_step_that_would_do():
    tree = yaml.safe_load((CONFIG / 'servos' / 'rv_bench.yaml').read_text())
    tree['step'] = 5e-3
    with pytest.raises(ServoError, match='step = 0.005 s is too long for the springs') as refusal:
        loads(yaml.safe_dump(tree))
    tree['step'] = float(re.search('at most ([0-9.e-]+) s', str(refusal.value))[1])
    assert 0.25 <= tree['step'] / longest_step(loads(yaml.safe_dump(tree))) <= 0.5


@pytest.mark.parametrize('drive', [
    {'gain': 0.5, 'torque_constant': 0.4},
    {'gain': 2.0, 'torque_constant': 0.4, 'resistance': 1.5, 'inductance': 1e-3, 'back_emf': 0.1}],
    ids=['current', 'voltage'])
def test_a_limit_that_falls_with_the_speed_is_steep_enough_to_chatter_just_beyond(drive):
    def chatter(slope, h=1e-3, pull=0.4):
        limit = Placed('limit', find('torque_speed_limit'), 'command')
        servo = Servo('limited', VoltageDrive if 'resistance' in drive else CurrentDrive, Rigid,
                      effects=(limit,), values={
                          **{f'drive.{name}': value for name, value in drive.items()},
                          'mechanism.ratio': 1.0, 'mechanism.rotor_inertia': 0.01,
                          'mechanism.load_inertia': 0.01, 'effects.limit.share': 1.0,
                          'effects.limit.limit': 5.0, 'effects.limit.slope': slope}, step=h)
        x = initial_state(servo, 0.0, 0.0)
        y = simulate(servo, inputs(3000, voltage=8.0, external_torque=pull), h, x)[:, 0]
        speed = np.diff(y[-200:]) / h
        return longest_step(servo) / h, float(np.ptp(speed) / np.abs(speed).max())

    low, high = 0.1, 1e4
    for _ in range(60):
        middle = (low * high) ** 0.5
        low, high = (middle, high) if chatter(middle)[0] > 1.0 else (low, middle)
    assert chatter(0.9 * low)[1] < 0.01 and chatter(1.1 * low)[1] > 0.1


def test_a_machine_without_any_inertia_is_refused():
    with pytest.raises(ServoError, match='both zero; give one of them'):
        check_step(Servo('nothing', CurrentDrive, Rigid, values={
            'mechanism.rotor_inertia': 0.0, 'mechanism.load_inertia': 0.0}))


def test_a_drive_with_loops_of_its_own_is_not_stepped_past_them():
    tree = yaml.safe_load((CONFIG / 'servos' / 'feed_drive.yaml').read_text())
    tree['step'] = 62.5e-6
    with pytest.raises(ServoError, match='longer than drive.current_cycle'):
        loads(yaml.safe_dump(tree))


@pytest.mark.long
@settings(max_examples=40)
@given(stiffness=st.floats(1e-3, 1e10), ratio=st.floats(1.0, 1e4), rotor=st.floats(1e-9, 1e3),
       load=st.floats(1e-9, 1e6), step=st.floats(1e-6, 1e-2))
def test_what_is_let_pass_keeps_its_energy(stiffness, ratio, rotor, load, step):
    servo = Servo('two', CurrentDrive, TwoInertia, values={
        'mechanism.ratio': ratio, 'mechanism.rotor_inertia': rotor,
        'mechanism.load_inertia': load, 'mechanism.stiffness': stiffness,
        'mechanism.damping': 0.0}, step=step)
    try:
        check_step(servo)
    except ServoError as refusal:
        assert 'give at most' in str(refusal).lower()
        return
    assume(step < 0.9 * longest_step(servo))
    x = initial_state(servo, 0.0, 0.0)
    x[LOAD_SPEED] = 1.0
    y = simulate(servo, inputs(2000), step, x)
    assert np.isfinite(y[:, :3]).all()
    swing_of_two = stiffness * (1.0 / (ratio**2 * rotor) + 1.0 / load)
    # the modified energy of the scheme bounds the torque: Hairer, Lubich, Wanner, sec. IX
    most = stiffness / np.sqrt(swing_of_two) / np.sqrt(1.0 - step**2 * swing_of_two / 4.0)
    assert np.abs(y[:, 2]).max() <= 1.01 * most + 1e-9 * stiffness * np.abs(y[:, 1]).max()


@pytest.mark.parametrize(('ratio', 'asked'), [(1.0 / 30.0, 'is it 30?'), (2.0, '')])
def test_a_step_that_is_too_long_asks_for_a_ratio_that_is_the_other_way_round(ratio, asked):
    with pytest.raises(ServoError) as problem:
        check_step(replace(machine(mechanism__ratio=ratio), step=0.1))
    assert str(problem.value).endswith(asked or 'less stiffness and damping')


@pytest.mark.parametrize(('effect', 'site', 'values'), [
    ('gravity', 'load', {'cosine': 1e4}), ('cogging', 'motor', {'cosine': (3.0,), 'order': 40.0}),
    ('cogging', 'motor', {'sine': (0.0, -3.0), 'cosine': (0.0, 0.0), 'order': 30.0})])
def test_a_torque_over_the_angle_is_a_spring_where_it_is_steepest(effect, site, values):
    placed = Placed('own', find(effect), site)
    servo = Servo('own', CurrentDrive, Rigid, effects=(placed,), values={
        **UNIT_DRIVE, 'mechanism.rotor_inertia': 0.0, 'mechanism.load_inertia': 1e-3,
        **placed.paths(values)}, step=1e-7)
    height = max(abs(np.atleast_1d(row)[-1]) for row in values.values() if row != values.get(
        'order'))
    order = values.get('order', 1.0) * max(len(np.atleast_1d(row)) for row in values.values())
    assert longest_step(servo) == pytest.approx(2.0 / np.sqrt(height * order / 1e-3), rel=0.02)


def test_drag_that_rises_once_static_friction_has_faded_is_judged():
    placed = Placed('own', find('slideway_friction'), 'load')
    servo = Servo('own', CurrentDrive, Rigid, effects=(placed,), values={
        **UNIT_DRIVE, 'mechanism.rotor_inertia': 0.0, 'mechanism.load_inertia': 1e-3,
        **placed.paths({'slope': 1.0, 'excess': 5.0, 'decay': 30.0})}, step=1e-7)
    assert longest_step(servo) == pytest.approx(1e-3, rel=1e-3)


def test_cold_grease_that_would_stop_a_shaft_each_other_step_is_refused():
    placed = Placed('own', find('viscous_drift'), 'motor')
    servo = Servo('own', CurrentDrive, Rigid, effects=(placed,), values={
        **UNIT_DRIVE, 'mechanism.rotor_inertia': 1e-3, 'mechanism.load_inertia': 0.0,
        'effects.own.excess': 100.0, 'effects.own.slope': 0.0}, step=1e-4)
    assert longest_step(servo) == pytest.approx(1e-5, rel=1e-3)
    with pytest.raises(ServoError, match='too long'):
        check_step(servo)
