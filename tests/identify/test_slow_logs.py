"""Logs that are slower than the loop of the firmware, and commands that are held between rows."""

from hypothesis import given
from hypothesis import strategies as some
import numpy as np
import pytest
from synthetic_recordings import run_of
from test_selection import named_by_equations

from servo_identify.data.rows_in_time import at_rows, held_over
from servo_identify.data.table_import import import_table
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained
from servo_twin.description import servo_file

SERVO = """
servo: hobby
step: 5.0e-4
drive: {type: voltage, gain: 1.0, resistance: 3.0, inductance: 0.0, back_emf: 0.4,
        torque_constant: 0.4}
mechanism: {type: rigid, rotor_inertia: 1.9e-3, load_inertia: 4.1e-3, ratio: 1.0}
controller: {type: none}
sensors: {motor_encoder: {noise: 4.4e-4}, voltage_sensor: {noise: 0.02}}
effects:
  weight: {effect: gravity, at: load, cosine: 0.0, sine: -0.36}
  rubs: {effect: coulomb_friction, at: load, level: 0.034}
  drags: {effect: viscous_friction, at: load, slope: 6.0e-3}
tolerance:
  drive.resistance: 6 %
  mechanism.load_inertia: 5 %
  effects.weight.sine: 5 %
  effects.rubs.level: 20 %
"""
FIRMWARE, STEP = 2e-3, 1e-4  # s, of its loop and of the integration


def hobby_servo(reference, rows, gain):
    """
    Return voltage and angle at the times ``rows`` (s) of a servo with a loop of its own.

    An integration that shares nothing with the twin; ``reference(time)`` in rad.
    """
    angle = speed = volts = 0.0
    count, seen, row = 2.0 * np.pi / 4096, [], 0
    for tick in range(int(rows[-1] / STEP) + 2):
        if tick % round(FIRMWARE / STEP) == 0:
            counted = round(angle / count) * count
            volts = min(max(gain * (reference(tick * STEP) - counted), -6.0), 6.0)
        while row < len(rows) and rows[row] <= tick * STEP:
            seen.append((volts, round(angle / count) * count))
            row += 1
        push = 0.4 * (volts - 0.4 * speed) / 3.0 - 0.36 * np.sin(angle)
        if abs(speed) < 3e-3 and abs(push) < 0.034:
            speed = 0.0
        else:
            speed += STEP * (push - 0.034 * np.tanh(speed / 0.01) - 6e-3 * speed) / 6e-3
            angle += STEP * speed
    return np.array(seen).T


REFERENCES = {
    'steps': lambda time: 0.9 if (time // 1.2) % 2 else -0.6,
    'sweep': lambda time: 0.8 * np.sin(2.0 * np.pi * (0.1 + 0.04 * time) * time),
    'tones': lambda time: 0.9 * np.sin(1.3 * time) + 0.4 * np.sin(2.9 * time + 1.0)}


def logged(tmp_path, name, seed, period, jitter):
    chance = np.random.default_rng(seed)
    rows = period * np.arange(int(16.0 / period)) + np.abs(
        chance.normal(0.0, jitter, int(16.0 / period)))
    volts, angle = hobby_servo(REFERENCES[name], rows, 9.0 + seed)
    path = tmp_path / f'{name}_{seed}.csv'
    path.write_text('t,voltage,motor_position\n' + ''.join(
        f'{t:.5f},{u:.3f},{a:.5f}\n' for t, u, a in zip(
            rows, volts + chance.normal(0.0, 0.02, len(rows)), angle, strict=True)))
    (tmp_path / 'servo.yaml').write_text(SERVO)
    return import_table(path, tmp_path / 'servo.yaml')


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('period, jitter', [(0.01, 3e-4), (0.02, 2e-3)])
def test_a_servo_that_is_logged_slower_than_its_loop_is_missing_nothing(tmp_path, period, jitter):
    several = [logged(tmp_path, name, seed, period, jitter)
               for seed, name in enumerate(REFERENCES)]
    assert named_by_equations(several, servo_file.loads(SERVO)) == set()


@given(some.lists(some.floats(0.2, 3.0), min_size=2, max_size=30),
       some.floats(0.3, 4.0), some.integers(0, 10**6))
def test_what_a_command_does_in_all_is_kept_on_another_grid(steps, ahead, seed):
    times = np.cumsum([0.0, *steps])
    values = np.random.default_rng(seed).normal(0.0, 1.0, len(times))
    rows = np.arange(0.0, times[-1] - ahead, ahead)
    found = held_over(rows, ahead, times, values)
    fine = np.linspace(0.0, len(rows) * ahead, 400_001)
    middle = 0.5 * (fine[1:] + fine[:-1])
    held = values[np.searchsorted(times, middle, 'right') - 1]
    assert found.sum() * ahead == pytest.approx(np.sum(held * np.diff(fine)), abs=1e-2)


def test_a_command_just_after_its_row_acts_with_it_and_not_a_row_later():
    rows = np.arange(0.0, 1.0, 0.1)
    steps = np.arange(10.0)
    found = at_rows(rows, rows + 0.002, steps, ahead=0.1)
    assert np.isnan(found[0]) and found[1:] == pytest.approx(steps[1:] - 0.02)
    assert at_rows(rows, rows, steps, ahead=0.1).tolist() == steps.tolist()
    gap = held_over(np.array([0.0, 0.2]), 0.1, np.array([0.0, 0.05]), np.array([np.nan, 3.0]))
    assert np.isnan(gap[0]) and gap[1] == 3.0


AGV = """
servo: agv
step: 1.0e-4
drive: {type: voltage, gain: 1.0, resistance: 1.0, inductance: 0.0005, back_emf: 0.035,
        torque_constant: 0.035}
mechanism: {type: rigid, rotor_inertia: 3.3e-5, load_inertia: 0.0, ratio: 1.0}
controller: {type: none}
sensors: {motor_encoder: {noise: 4.4e-4}, current_sensor: {noise: 0.02}}
effects:
  rubs: {effect: coulomb_friction, at: motor, level: 6.3e-3}
  drags: {effect: viscous_friction, at: motor, slope: 1.0e-4}
tolerance: {drive.resistance: 6 %, drive.back_emf: 4 %, mechanism.rotor_inertia: 8 %}
"""


@pytest.mark.long
@pytest.mark.slow
def test_a_command_that_comes_two_rows_and_a_half_late_is_no_lag():
    """Lags of more than all of a command, one against the other, do what a delay does."""
    def run(seed, period=2e-3, rows=5000, fine=40):
        time, chance = period * np.arange(rows), np.random.default_rng(seed)
        volts = sum(np.sin(2.0 * np.pi * f * time + seed * f) for f in (0.5, 1.7, 4.3, 9.0))
        current = speed = angle = 0.0
        seen, late, step = [], int(2.5 * fine), period / fine
        for tick in range(rows * fine):
            if tick % fine == 0:
                seen.append((angle, current))
            acts = 4.0 * volts[(tick - late) // fine] if tick >= late else 0.0
            current = (current + step / 5e-4 * (acts - 0.035 * speed)) / (1.0 + step / 5e-4)
            speed += step * (0.035 * current - 1e-4 * speed - 6.3e-3 * np.tanh(
                speed / 0.05)) / 3.3e-5
            angle += step * speed
        angle, current = np.array(seen).T
        known = {'voltage': 4.0 * volts, 'current': current + 0.02 * chance.standard_normal(rows),
                 'motor_position': angle + 4.4e-4 * chance.standard_normal(rows)}
        return run_of(seed, period, known, 'tones')

    found = explained(residual_samples([run(seed) for seed in (1, 2)], servo_file.loads(AGV)))
    assert [one.mechanism.name for one in found.chosen] == ['command_delay']
    late = np.dot(found.chosen[0].knots, found.amplitudes(
        found.explanation.smallest.choice.numbers[0]))
    assert late == pytest.approx(0.005, abs=1.2e-3)  # but for when a row is read
