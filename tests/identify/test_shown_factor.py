"""A reference that is off by a factor, whatever it is: the check ..."""

from dataclasses import replace

from bench_recording import bench_recording, SERVO
import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from servo_identify.data.recording_check import check
from servo_twin.description.servo_file import load, loads
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, PREDICTED, Recording

BENCH = load(SERVO)
AXIS = loads("""
servo: axis
step: 0.001
drive: {type: current, gain: 1.0, torque_constant: 0.5}
mechanism: {type: rigid, rotor_inertia: 0.001, load_inertia: 0.4, ratio: 20.0}
controller: {type: position_loop, kp: 20.0, kv: 1.0, ki: 5.0, kd: 1.0, kf: 1.0, filter: 0.001,
             limit: 20.0}
sensors: {motor_encoder: {noise: 0.0001}, current_sensor: {noise: 0.02}}
effects: {dry: {effect: coulomb_friction, at: motor, level: 0.05}}
""")


def without(columns, *names):
    return {**columns, **{name: np.full(len(columns[name]), np.nan) for name in names}}


def run(size=0.8, servo=AXIS, **factors):
    """Return moves of an axis in a position loop; ``factors`` multiply channels of the log."""
    time = np.arange(6000) * 1e-3
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    speed = size * (np.sin(2.0 * time) + 0.7 * np.sin(5.3 * time))
    columns['reference_velocity'] = speed
    columns['reference_position'] = cumulative_trapezoid(speed, time, initial=0.0)
    made = simulate(servo, inputs_of(columns), 1e-3, initial_state(servo), 'closed_loop')
    columns.update(zip(PREDICTED, made.T.copy(), strict=True))
    columns['load_position'] = np.full(len(time), np.nan)
    chance = np.random.default_rng(3)
    for name in ('motor_position', 'current'):
        columns[name] = columns[name] + AXIS.noise(name) * chance.standard_normal(len(time))
    return Recording('run', 1e-3, {name: factors.get(name, 1.0) * column
                                   for name, column in columns.items()})


def said(one, servo=AXIS):
    return [finding for finding in check([one], servo)
            if 'what the angle follows' in finding.sentence]


def green(one, servo=AXIS):
    return any('No unit, scale or sign' in finding.sentence for finding in check([one], servo))


def test_it_says_nothing_of_references_that_are_right():
    assert not said(run()) and green(run())


@pytest.mark.parametrize('channel', ['reference_position', 'reference_velocity'])
@pytest.mark.parametrize('factor', [10.0, 0.1, 37.0])
def test_it_is_red_about_a_reference_that_is_off_by_any_factor(channel, factor):
    found, = said(run(**{channel: factor}))
    assert found.level == 'red' and f'run: {channel} is ' in found.sentence
    assert f'and {factor:.3g} times' in found.sentence and 'its scale in the' in found.action


def test_it_leaves_a_unit_that_has_a_name_to_its_name():
    found, *_ = check([run(reference_velocity=180.0 / np.pi)], AXIS)
    assert found.level == 'red' and 'is in deg/s' in found.sentence


def test_it_asks_about_a_reference_that_is_off_by_less():
    found, = said(run(reference_velocity=2.0))
    assert found.level == 'amber' and 'is it in another unit?' in found.sentence
    assert not green(run(reference_velocity=2.0))


def test_it_asks_about_a_reference_by_its_tracking_alone():
    one = replace(bench_recording(4.0), servo_file='')
    columns = {**one.columns, 'reference_velocity': 6.0 * one['reference_velocity']}
    found, = said(replace(one, columns=without(columns, 'voltage')), BENCH)
    assert found.level == 'amber' and 'reference_velocity is 5.9 times' in found.sentence


@pytest.mark.parametrize('factor', [0.5, 2.0, 5.0])
def test_a_loop_with_an_integral_follows_the_whole_way(factor):
    one = run(reference_position=factor)
    found, = said(replace(one, columns=without(one.columns, 'reference_velocity', 'voltage')))
    assert found.level == 'amber' and 'reference_position is ' in found.sentence
    assert float(found.sentence.split(' times')[0].split()[-1]) == pytest.approx(factor, rel=0.05)


@pytest.mark.parametrize('factor', [1.0, 0.5, 1.3, 2.0, 5.0])
def test_the_command_tells_the_factor_of_a_reference_that_is_followed_badly(factor):
    servo = AXIS.with_values({'controller.ki': 0.0, 'controller.kf': 0.0, 'controller.kv': 0.02})
    one = run(servo=servo, reference_position=factor)
    one = replace(one, columns=without(one.columns, 'reference_velocity'))
    found = [each for each in check([one], servo) if 'makes the command of' in each.sentence]
    assert [each.level for each in found] == (['red'] if factor != 1.0 else [])
    assert all(f'reference_position is {factor:g} times' in each.sentence for each in found)


def test_a_command_of_another_law_tells_no_factor():
    servo = AXIS.with_values({'controller.kp': 60.0, 'controller.kd': 0.1})
    assert not [one for one in check([run()], servo) if 'makes the command of' in one.sentence]


def test_it_leaves_a_loop_alone_that_follows_badly():
    assert not said(run(size=0.002))


def test_it_blames_no_reference_that_the_controller_does_not_read():
    open_loop = loads("""
servo: axis
drive: {type: current, gain: 1.0, torque_constant: 0.5}
mechanism: {type: rigid, rotor_inertia: 0.001, load_inertia: 0.4, ratio: 20.0}
controller: {type: none}
""")
    assert not said(run(reference_velocity=10.0), open_loop)
