"""Limits of a drive, filters of readings and references, and a part that some recordings hold."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from synthetic_recordings import from_rest
from test_selection import named_by_equations

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.mechanisms.shape_search import best_shape, best_shapes
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

HIP = servo_file.loads("""
servo: hip
step: 5.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.1}
mechanism: {type: rigid, rotor_inertia: 1.0e-4, load_inertia: 0.03, ratio: 9.0}
sensors: {motor_encoder: {noise: 1.0e-4}, current_sensor: {noise: 0.1}}
effects:
  rubs: {effect: coulomb_friction, at: load, level: 0.4}
  drags: {effect: viscous_friction, at: load, slope: 0.1}
  weight: {effect: gravity, at: load, cosine: 0.0, sine: -2.5}
""")
PERIOD = 2e-3


def swung(rig, seed, size=6.0, seconds=12.0, commanded=True, behind=0.0,
          tones=(0.4, 0.9, 1.7, 3.1)):
    """Return a joint that a sum of sines of current swings; its current may pass a filter."""
    time = np.arange(0.0, seconds, PERIOD)
    chance = np.random.default_rng(seed)
    phase = chance.uniform(0.0, 2.0 * np.pi, len(tones))
    command = size * np.sin(2.0 * np.pi * time[:, None] * np.array(tones) + phase).mean(axis=1)
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['voltage'] = command
    y = simulate(rig, inputs_of(columns), PERIOD, initial_state(rig, 0.0, 0.0), 'measured_input')
    angle, current = y[:, 0], y[:, 3]
    if behind:
        keep = np.exp(-PERIOD / behind)
        current = lfilter([1.0 - keep], [1.0, -keep], current)
    seen = {'motor_position': angle + chance.normal(0.0, 1e-4, len(time)),
            'current': current + chance.normal(0.0, 0.1, len(time))}
    if commanded:
        seen['voltage'] = command
    return Recording(f'swing {seed}', PERIOD, columns | seen if commanded else {
        **columns, 'voltage': columns['torque'], **seen}, family='swing', replicate=seed,
        digest=f'{seed:064d}')


@pytest.mark.long
@pytest.mark.slow
def test_a_drive_that_runs_out_of_voltage_at_speed_is_named_with_its_line():
    limited = HIP.with_effects(Placed('e', find('torque_speed_limit'), 'command'),
                               values={'effects.e.limit': 30.0, 'effects.e.slope': 0.25})
    several = [swung(limited, seed, size=20.0) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], HIP, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['torque_speed_limit']
    values = answer.augmented.numbers
    at = 1.0 / values['effects.torque_speed_limit.slope']  # the speed without any current
    assert at * values['effects.torque_speed_limit.limit'] == pytest.approx(120.0, rel=0.05)


@pytest.mark.long
def test_a_current_that_passed_a_filter_is_late_and_no_resonance():
    several = [swung(HIP, seed, commanded=False, behind=0.015) for seed in (1, 2)]
    assert named_by_equations(several, HIP) == {('sensor_lag', 'current')}
    assert named_by_equations([swung(HIP, seed, commanded=False) for seed in (1, 2)], HIP) == set()


@pytest.mark.long
@pytest.mark.slow
def test_a_part_held_in_some_recordings_differs_by_recording_and_is_told_with_them():
    holds = HIP.with_values({'effects.weight.sine': -3.4, 'mechanism.load_inertia': 0.036})
    several = [swung(holds if seed in (2, 4) else HIP, seed, commanded=False)
               for seed in (1, 2, 3, 4, 5)]
    report = diagnose(several[:3], HIP, several[3:4], several[4:]).report
    weight = next(one for one in report.which if one.effect == 'gravity')
    assert weight.mechanism['variables'] == ['recording']
    assert weight.change.startswith('in swing 2 0.9') and 'in the others 0' in weight.change
    assert 'on their own' in report.verdict['sentence']
    assert 'warm up' not in report.verdict['sentence']


@pytest.mark.long
@pytest.mark.slow
def test_the_weight_of_a_carried_axis_shows_by_both_angles():
    def with_elbow(seed):
        time = np.arange(0.0, 12.0, PERIOD)
        elbow = 1.1 * np.sin(2.0 * np.pi * 0.23 * time + seed)
        one = swung(HIP, seed, commanded=False)
        pulled = one['current'] + 1.6 / 9.0 / 0.1 * np.sin(one['motor_position'] / 9.0 + elbow)
        return replace(one, columns={**one.columns, 'current': pulled, 'coupled_position': elbow})

    several = [with_elbow(seed) for seed in (1, 2, 3)]
    report = diagnose(several[:1], HIP, several[1:2], several[2:]).report
    assert [one.effect for one in report.which] == ['external_torque']
    assert float(report.which[0].change.partition(' ')[0]) == pytest.approx(1.6, rel=0.05)
    assert 'sum of both angles' in report.which[0].change


LOOP = servo_file.loads("""
servo: turret
step: 5.0e-4
drive: {type: voltage, resistance: 3.0, inductance: 0.0, back_emf: 0.0125, torque_constant: 0.0125}
mechanism: {type: rigid, rotor_inertia: 2.0e-6, load_inertia: 0.012, ratio: 90.0}
controller: {type: position_loop, kp: 8.0, kv: 6.0, ki: 0.0, kd: 1.0, limit: 12.0, on_load: 0.0}
sensors: {motor_encoder: {noise: 1.0e-3}, current_sensor: {noise: 0.01}}
effects:
  rubs: {effect: coulomb_friction, at: load, level: 0.07}
""")


def following(firmware, seed, smooths=0.0):
    """Return a recording of the turret; ``smooths`` s is the lag of what its loop follows."""
    time, chance = np.arange(0.0, 12.0, PERIOD), np.random.default_rng(seed)
    goal = sum(0.3 * np.sin(2.0 * np.pi * f * time + chance.uniform(0.0, 6.0))
               for f in (0.3, 0.8, 1.9))
    goal -= goal[0]
    keep = np.exp(-PERIOD / smooths) if smooths else 0.0
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['reference_position'] = lfilter([1.0 - keep], [1.0, -keep], goal)
    columns['reference_velocity'] = np.gradient(columns['reference_position'], PERIOD)
    y = simulate(firmware, inputs_of(columns), PERIOD, initial_state(firmware, 0.0, 0.0),
                 'closed_loop')
    seen = {'reference_position': goal, 'reference_velocity': np.full(len(time), np.nan),
            'voltage': y[:, 4],
            'motor_position': y[:, 0] + chance.normal(0.0, 1e-3, len(time)),
            'current': y[:, 3] + chance.normal(0.0, 0.01, len(time))}
    return Recording(f'goals {seed}', PERIOD, columns | seen, family='goals', replicate=seed,
                     digest=f'{seed:064d}')


@pytest.mark.long
@pytest.mark.slow
def test_a_firmware_that_smooths_its_reference_is_no_other_gain():
    several = [following(LOOP, seed, 0.045) for seed in (1, 2, 3)]
    report = diagnose(several[:1], LOOP, several[1:2], several[2:]).report
    first = report.which[0]
    assert first.effect == 'controller_mismatch'
    assert float(first.change.rpartition(' of ')[2].removesuffix(' s')) == pytest.approx(
        0.045, rel=0.15)
    assert 'recorded command' in report.verdict['sentence']


@pytest.mark.long
@pytest.mark.slow
def test_a_reference_speed_that_was_not_recorded_is_that_of_the_reference():
    fed = LOOP.with_values({'controller.kf': 1.0})
    several = [following(fed, seed) for seed in (1, 2)]
    assert not several[0].has('reference_velocity')
    assert named_by_equations(several, fed) == set()
    assert named_by_equations(several, LOOP) == {('controller_mismatch', 'controller')}


@pytest.mark.long
@pytest.mark.slow
def test_a_log_that_is_slower_than_the_loop_is_no_other_inductance():
    winding = LOOP.with_values({'drive.inductance': 4e-3})  # L/R of 1.3 ms

    def logged(seed):
        time, chance = np.arange(0.0, 20.0, 1e-3), np.random.default_rng(seed)
        goal = sum(0.3 * np.sin(2.0 * np.pi * f * time + chance.uniform(0.0, 6.0))
                   for f in (0.3, 1.1, 3.7))
        columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
        columns['reference_position'] = goal - goal[0]
        y = simulate(winding, inputs_of(columns), 1e-3, initial_state(winding, 0.0, 0.0),
                     'closed_loop')[::5]
        seen = {name: column[::5] for name, column in columns.items()}
        seen |= {'voltage': y[:, 4],
                 'motor_position': y[:, 0] + chance.normal(0.0, 1e-3, len(y)),
                 'current': y[:, 3] + chance.normal(0.0, 0.01, len(y))}
        return Recording(f'log {seed}', 5e-3, seen, family='log', digest=f'{seed:064d}')

    assert named_by_equations([logged(seed) for seed in (1, 2)], winding) == set()


@pytest.mark.long
@pytest.mark.slow
def test_an_integral_that_held_a_weight_before_the_recording_is_no_other_gain():
    hoist = LOOP.with_effects(Placed('weight', find('constant_torque'), 'load'),
                              values={'effects.weight.torque': 1.0}).with_values(
        {'controller.ki': 30.0, 'controller.limit': 5.0})
    several = [following(hoist, seed) for seed in (1, 2)]
    cut = [replace(one, columns={name: column[len(one) // 3:]
                                 for name, column in one.columns.items()}) for one in several]
    at_limit = [np.isclose(np.abs(one['voltage']), 5.0) for one in cut]
    assert all(0.02 < np.mean(one) < 0.5 for one in at_limit)
    assert named_by_equations(cut, hoist) == set()
    stiffer = hoist.with_values({'controller.kv': 1.3 * hoist.numbers['controller.kv']})
    assert ('controller_mismatch', 'controller') in named_by_equations(cut, stiffer)


@pytest.mark.slow
@pytest.mark.parametrize('opens', [0.72, 1.05])  # V, between two shares of the largest command
def test_a_drive_that_comes_with_all_of_its_command_has_a_dead_band(opens):
    def run(seed):
        time, chance = np.arange(0.0, 12.0, PERIOD), np.random.default_rng(seed)
        sent = sum(1.7 * np.sin(2.0 * np.pi * f * time + chance.uniform(0.0, 6.0))
                   for f in (0.4, 1.1, 2.3))
        came = from_rest(LOOP, np.where(np.abs(sent) < opens, 0.0, sent), PERIOD, chance)
        return replace(came, columns={**came.columns, 'voltage': sent}, digest=f'{seed:064d}')

    assert named_by_equations([run(seed) for seed in (1, 2)], LOOP) == {
        ('drive_dead_band', 'command')}


@pytest.mark.long
@pytest.mark.slow
def test_a_filter_that_firmware_steps_by_differences_is_no_other_filter():
    time = 4.0 * PERIOD
    told = LOOP.with_values({'controller.filter': time})
    backward, forward = PERIOD / np.log1p(PERIOD / time), -PERIOD / np.log1p(-PERIOD / time)
    for acts, named in ((backward, set()), (forward, set()), (3.0 * time, {
            ('controller_mismatch', 'controller')})):
        stepped = told.with_values({'controller.filter': acts})
        assert named_by_equations([following(stepped, seed) for seed in (1, 2)], told) == named


def test_a_reference_that_steps_says_no_speed():
    fed = LOOP.with_values({'controller.kf': 1.0})
    smooth = following(fed, 1)
    steps = replace(smooth, columns={**smooth.columns, 'reference_position': np.round(
        smooth['reference_position'], 1)})
    for servo, judged in ((LOOP, True), (fed, False)):
        assert ('controller' in residual_samples([steps], servo).present) is judged


@pytest.mark.long
@pytest.mark.slow
def test_of_gains_that_make_up_for_each_other_the_one_that_is_off_is_named():
    several = [following(LOOP.with_values({'controller.kv': 4.0}), seed) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], LOOP, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['controller_mismatch']
    assert answer.augmented.numbers['controller.kv'] == pytest.approx(4.0, rel=0.02)
    assert answer.augmented.numbers['controller.kd'] == LOOP.numbers['controller.kd']
    assert 'kd' not in answer.report.verdict['sentence']


@pytest.mark.long
def test_what_pushes_by_the_place_over_many_turns_is_a_spring_and_no_matter_of_the_load():
    drum = HIP.without_effects(lambda placed: placed.name == 'weight').with_values(
        {'effects.drags.slope': 0.3})
    rope = drum.with_effects(Placed('e', find('spring_load'), 'load'),
                             values={'effects.e.stiffness': 0.03, 'effects.e.rest': 0.0})
    several = [swung(rope, seed, size=14.0, seconds=30.0, tones=(0.06, 0.11, 1.7))
               for seed in (1, 2)]
    assert np.ptp(several[0]['motor_position']) / 9.0 > 4.0 * np.pi
    assert named_by_equations(several, drum) == {('spring_load', 'load')}


def test_a_shape_is_sought_with_its_amplitude_free_or_as_it_is():
    x = np.linspace(0.0, 1.0, 400)
    assert best_shape(0.05, 5.0, lambda time: np.exp(-x / time), -3.0 * np.exp(-x / 0.4)) == (
        pytest.approx(0.4, rel=0.02))
    lag = lfilter([0.1], [1.0, -0.9], np.sign(np.sin(20.0 * x))) - np.sign(np.sin(20.0 * x))

    def late(time):
        keep = np.exp(-1.0 / time)
        way = np.sign(np.sin(20.0 * x))
        return lfilter([1.0 - keep], [1.0, -keep], way) - way

    assert best_shape(0.1, 100.0, late, -lag, whole=True) == pytest.approx(
        -1.0 / np.log(0.9), rel=0.02)
    hinge = -2.0 * np.maximum(x - 0.6 + 0.2 * np.cos(9.0 * x), 0.0)
    begin, swing = best_shapes([(0.1, 1.0), (0.02, 1.0)], lambda begin, swing: np.maximum(
        x - begin + swing * np.cos(9.0 * x), 0.0), hinge)
    assert (begin, swing) == pytest.approx((0.6, 0.2), rel=0.05)


def test_a_narrow_resonance_is_found_within_five_decades():
    tones = np.geomspace(0.1, 1000.0, 4000)

    def swing(stiffness, damped):
        tone = tones / np.sqrt(stiffness)
        return 1.0 / (1.0 - tone**2 + 2j * damped * tone)

    def column(*numbers):
        return np.concatenate((swing(*numbers).real, swing(*numbers).imag))

    found = best_shapes([(1.0, 1e5), (0.01, 1.0)], column, -column(320.0, 0.03), whole=True,
                        shapes=(47, 4))
    assert found == pytest.approx((320.0, 0.03), rel=0.05)


@pytest.mark.long
@pytest.mark.slow
def test_friction_that_no_line_within_tolerance_follows_is_handed_over_as_its_curve():
    file = replace(HIP, tolerance={'effects.rubs.level': (0.34, 0.46),
                                   'effects.drags.slope': (0.07, 0.13)})
    drag = HIP.with_effects(Placed('e', find('friction_over_speed'), 'load'), values={
        'effects.e.low': 0.0, 'effects.e.high': 12.0,
        'effects.e.curve': tuple(np.sqrt(np.linspace(0.0, 12.0, 8)) - 1.0),
        'effects.drags.slope': 0.0})
    several = [swung(drag, seed, size=8.0, commanded=False) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], file, several[1:2], several[2:])
    first = answer.report.which[0]
    assert not first.effect.startswith('parameter:') and first.curve['variable'] == 'speed'
    assert answer.report.gap['solved'] > 0.8
