"""Residual balances do not take for a gap how a recording happened to begin: it ..."""

from bench_recording import bench_recording, SERVO
import numpy as np
import pytest

from servo_twin.balances.goodness_of_fit import fit_of
from servo_twin.balances.residual_filters import Balances
from servo_twin.description.servo_file import load
from servo_twin.lockstep.lockstep import Settings
from servo_twin.lockstep.whole_recording import answer
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import OUTPUTS, ZERO
from servo_twin.recording.joined_samples import CHANNELS
from servo_twin.recording.recording import BALANCES, COLUMNS, PREDICTED, Recording

PERIOD = 1e-3


def over_noise(recording: Recording, servo: Servo) -> dict[str, float]:
    """Return the residual of each balance over its noise, as a replay tells it."""
    fit = fit_of(recording, answer(recording, servo), servo)
    return {row.balance: row.over_noise for row in fit.balances}


def begun_in_gap(servo: Servo, off: float, still: float) -> Recording:
    """Return a noisy recording whose gears begin ``off`` rad from the middle of their gap."""
    time = np.arange(6000) * PERIOD
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['voltage'] = np.where(time < still, 0.0, 3.0 * np.sin(np.pi * (time - still)))
    x = initial_state(servo)
    x[ZERO] += off
    y = simulate(servo, inputs_of(columns), PERIOD, x)
    columns.update(zip(PREDICTED[:4], y.T[:4].copy(), strict=True))
    random = np.random.default_rng(1)
    for name in PREDICTED[:4]:
        columns[name] += servo.noise(name) * random.standard_normal(len(time))
    return Recording('gap', PERIOD, columns)


@pytest.mark.parametrize('off', [-0.003, 0.0, 0.003])
def test_a_transmission_that_begins_in_its_gap_is_no_gap_of_the_twin(off):
    servo = load(SERVO.with_name('geared_dc.yaml'))
    found = over_noise(begun_in_gap(servo, off, 0.2), servo)
    assert found['transmission'] < 20.0  # 75, 312 and 548 of an angle that stayed for good
    assert found['transmission'] < 2.0 * max(1.0, found['sensor'])  # what is left is no constant


def test_a_wider_gap_than_the_twins_is_seen_wherever_it_began():
    servo = load(SERVO.with_name('geared_dc.yaml'))
    rig = servo.with_values({'effects.play.width': 10e-3})
    assert over_noise(begun_in_gap(rig, 0.003, 0.2), servo)['transmission'] > 50.0


def test_the_noise_of_the_first_sample_does_not_stay_in_the_transmission():
    assert over_noise(bench_recording(), load(SERVO))['transmission'] < 1.2


def test_an_angle_beyond_the_noise_of_a_sample_stays_in_the_transmission():
    servo = load(SERVO)
    samples, y = np.zeros((400, len(CHANNELS))), np.zeros((400, len(OUTPUTS)))
    samples[:, CHANNELS.index('load_position')] = 1e-3
    found = Balances(servo, PERIOD).whole(samples, y)[:, BALANCES.index('transmission')]
    assert np.nanmin(np.abs(found)) > 0.9 * 1e-3 / 4.35e-7


@pytest.mark.parametrize('lag', [0.0, 0.004])
def test_a_recording_that_begins_in_motion_is_no_gap_of_the_controller(lag):
    servo = load(SERVO).with_values({'controller.filter': lag})
    whole = bench_recording(of=servo)
    moving = whole.part(whole.sequence + 300, whole.sequence + len(whole))
    assert over_noise(whole, servo)['controller'] < 1.2
    assert over_noise(moving, servo)['controller'] < 1.2


@pytest.mark.parametrize('lag', [0.0, 0.01])
def test_a_loop_that_is_closed_in_motion_makes_no_bump(lag):
    servo = load(SERVO).with_values({'controller.filter': lag})
    whole = bench_recording(of=servo)
    moving = whole.part(whole.sequence + 300, whole.sequence + len(whole))
    off = answer(moving, servo, Settings(mode='closed_loop')).prediction['voltage'] - (
        moving['voltage'])
    assert np.abs(off[:500]).max() < 0.1  # V; 2.0 where the loop began at a speed of zero


def test_another_gain_is_seen_in_a_recording_that_begins_in_motion():
    servo = load(SERVO)
    whole = bench_recording(of=servo.with_values({'controller.kp': 17.0}))
    moving = whole.part(whole.sequence + 300, whole.sequence + len(whole))
    assert over_noise(moving, servo)['controller'] > 3.0
