"""Numbers that stand for what was not measured: the check ..."""

from dataclasses import replace

from bench_recording import bench_recording, SERVO
from init_bench import gear_motor, init, write
import numpy as np
import pytest

from servo_identify.data.fill_values import fill_value_of
from servo_identify.data.recording_check import check
from servo_twin.description.servo_file import load


@pytest.mark.parametrize('column', ['current', 'motor_position', 'load_position', 'torque'])
@pytest.mark.parametrize(('value', 'rows'), [(-9999.0, [600]), (1e10, [3, 700, 701])])
def test_it_names_the_number_and_says_nothing_else_of_it(column, value, rows):
    good = bench_recording(2.0)
    values = good[column].copy()
    values[rows] = 1e3 * value
    found, = check([replace(good, columns={**good.columns, column: values})], load(SERVO))
    assert found.level == 'red' and 'leave the cell empty' in found.action
    assert f'{column} is {1e3 * value:.6g} in {len(rows)} row' in found.sentence


def test_init_takes_no_such_number_for_the_round_of_a_counter(tmp_path, capsys):
    run = gear_motor()
    angle = np.where(np.arange(len(run['time'])) == 600, -9999.0, run['theta'])
    data = write(tmp_path / 'a.csv', {'t': run['time'], 'voltage': run['u'],
                                      'current': run['i'], 'motor_position': angle})
    assert init(data, tmp_path) == 1
    said = capsys.readouterr().out
    assert 'motor_position is -9999 in 1 row' in said and 'wraps' not in said


@pytest.mark.parametrize('values', [
    np.clip(np.linspace(-2.0, 2.0, 100), -1.0, 1.0), np.r_[np.zeros(99), 24.0], np.ones(50),
    np.full(9, np.nan), np.r_[np.linspace(0.0, 1.0, 99), 5.0]])
def test_what_ends_at_a_limit_or_steps_once_is_none(values):
    assert fill_value_of(values) is None


def test_a_current_before_its_first_step_is_measured():
    ripple = 1.6 + 0.05 * np.sin(np.arange(100))
    for rows in (np.r_[0.002, ripple], np.r_[ripple, 0.002, 0.002]):
        assert fill_value_of(rows, steps=True) is None
        assert fill_value_of(rows) is not None  # an angle does not step
    assert fill_value_of(np.r_[ripple, 0.002, ripple], steps=True) == (0.002, 1)
    assert fill_value_of(np.r_[-9999.0, ripple], steps=True) == (-9999.0, 1)
