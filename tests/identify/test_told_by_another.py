"""Channels that hold no measurement of their own, or not all of it: the check ..."""

from dataclasses import replace

from bench_recording import bench_recording, SERVO
import numpy as np
import pytest

from servo_identify.data.clipped import clipped
from servo_identify.data.recording_check import check
from servo_identify.data.told_by_another import held
from servo_twin.description.servo_file import load

BENCH = load(SERVO)
RATIO = BENCH.numbers['mechanism.ratio']


@pytest.fixture(scope='module')
def good():
    return bench_recording(4.0)


def said(one, words, servo=BENCH, **columns):
    changed = replace(one, columns={**one.columns, **columns})
    return [finding for finding in check([changed], servo) if words in finding.sentence]


@pytest.mark.parametrize('words', ['in all samples', 'is held', 'is it clipped'])
def test_it_says_nothing_of_channels_that_were_measured(good, words):
    assert not said(good, words)


@pytest.mark.parametrize(('late', 'words'), [
    (0, 'current is 0.31 times the command (voltage) in all samples'),
    (3, 'current is 0.31 times, and 3 ms later than, the command (voltage) in all samples')])
def test_it_asks_whether_a_current_is_a_copy_of_the_command(good, late, words):
    copy = np.round(np.roll(0.31 * good['voltage'], late), 5)
    found, = said(good, words, current=copy)
    assert found.level == 'amber' and 'leave the column out' in found.action


@pytest.mark.parametrize('late', [0, 5, -5])
def test_it_asks_whether_two_encoders_are_one(good, late):
    copy = np.roll(good['motor_position'] / RATIO, late)
    copy[:5], copy[-5:] = copy[5], copy[-6]
    found, = said(good, 'load_position is ', load_position=copy)
    assert 'columns of one sensor?' in found.sentence
    assert ('5 ms later than, motor' in found.sentence) == (late > 0)
    assert ('5 ms before, motor' in found.sentence) == (late < 0)


@pytest.mark.parametrize(('name', 'ratio'), [('motor_position', RATIO), ('load_position', 1.0)])
def test_it_asks_whether_an_encoder_was_read_at_all(good, name, ratio):
    place = np.cumsum(good['reference_velocity']) * good.period
    found, = said(good, 'was no encoder read?', reference_position=place, **{name: ratio * place})
    assert found.level == 'amber' and found.sentence.split(': ')[1].startswith(name)


@pytest.mark.parametrize(('celsius', 'words'), [
    (298.0, 'is it in K?'), (4100.0, 'is it in K?'), (-4100.0, 'a count of the sensor?')])
def test_it_asks_in_which_unit_a_temperature_is_that_no_servo_has(good, celsius, words):
    found, = said(good, words, temperature=celsius + np.arange(len(good)) * 1e-4)
    assert found.level == 'amber' and 'offset' in found.action
    assert not said(good, 'temperature', temperature=np.full(len(good), 155.0))


@pytest.mark.parametrize('name', ['motor_position', 'load_position', 'current', 'torque'])
@pytest.mark.parametrize('rows', [3, 20])
def test_it_says_how_long_a_value_is_held(good, name, rows):
    found, = said(good, f'{name} changes in one row of {rows} alone',
                  **{name: np.repeat(good[name][::rows], rows)[:len(good)]})
    assert f'is held for {rows} ms' in found.sentence
    assert f'--period {rows * 1e-3:g}' in found.action


@pytest.mark.parametrize('counts_a_row', [0.05, 0.4, 3.0, 11.0])
def test_an_encoder_that_rests_on_a_count_is_not_held(counts_a_row):
    time = np.arange(4000)
    assert held(np.floor(counts_a_row * 1000.0 * np.sin(time / 1000.0)) * 1e-3) == 1.0


def test_a_shaft_that_sticks_and_slips_is_not_held():
    slip = np.concatenate((np.zeros(80), 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 20))))
    place = np.concatenate([n + slip for n in range(40)])
    creeps = np.arange(len(place)) * 2e-5
    assert held(np.round((place + creeps) * 400.0) / 400.0) == 1.0


@pytest.mark.parametrize('digits', [8, 2])
def test_it_asks_whether_a_current_is_clipped(good, digits):
    most = 0.6 * np.max(np.abs(good['current']))
    current = np.round(np.clip(good['current'], -most, most), digits)
    found, = said(good, 'is it clipped?', current=current)
    assert f'{np.max(current):.4g} and {np.min(current):.4g} A' in found.sentence


def test_a_limit_of_the_servo_file_needs_no_question(good):
    most = 0.6 * np.max(np.abs(good['current']))
    limited = BENCH.with_values({'controller.limit': most / BENCH.numbers['drive.gain']})
    assert not said(good, 'is it clipped', limited, current=np.clip(good['current'], -most, most))


@pytest.mark.parametrize('digits', [1, 2, 3, 9])
def test_the_top_of_a_wave_that_was_rounded_is_not_clipped(digits):
    time = np.arange(4000) * 1e-3
    for wave in (np.sin(6.0 * time), np.sin(6.0 * time) + 0.3 * np.sin(31.0 * time + 1.0)):
        assert clipped(np.round(wave, digits)) == {}


def test_steady_torques_between_steps_are_not_clipped():
    steps = np.repeat([0.0, 2.0, 1.0, -1.0, -2.0, 0.0, 2.0, 1.0, -1.0, -2.0], 300)
    assert clipped(steps) == {}


@pytest.mark.parametrize('torque', [0.5, 161.0])
def test_a_torque_that_was_computed_is_no_mistake_of_a_unit(good, torque):
    made = torque * good['current']
    assert said(good, 'was it computed from it?', torque=made)
    changed = replace(good, columns={**good.columns, 'torque': made})
    assert not [one for one in check([changed], BENCH) if one.level == 'red']


@pytest.mark.parametrize('channel', ['current', 'nothing'])
def test_the_voltage_of_the_supply_is_no_command_in_another_unit(good, channel):
    nothing = np.full(len(good), np.nan)
    columns = {**good.columns, 'voltage': np.full(len(good), 24.0), 'reference_velocity': nothing}
    columns |= {} if channel == 'current' else {'current': nothing, 'torque': nothing}
    found = check([replace(good, columns=columns)], BENCH)
    asked, = [one for one in found if 'is it the voltage of the supply?' in one.sentence]
    assert asked.level == 'amber' and 'stays near 24 while' in asked.sentence
    assert not [one for one in found if one.level == 'red' or 'voltage is in mV' in one.sentence]


@pytest.mark.parametrize('rate', [400.0, 701.0, 1000.0])
def test_a_value_that_was_held_is_seen_behind_an_interpolation(rate):
    slow = np.arange(0.0, 10.0, 0.02)
    fine = np.arange(0.0, 10.0, 0.002)
    written = np.sin(3.0 * slow)[(fine / 0.02 + 1e-9).astype(int)]
    time = np.arange(0.0, 9.9, 1.0 / rate)
    assert held(np.interp(time, fine, written)) == pytest.approx(0.02 * rate, rel=0.05)


@pytest.mark.parametrize('count', [1e-3, 1e-2])
def test_an_encoder_of_few_counts_is_not_held_behind_an_interpolation(count):
    fine, time = np.arange(0.0, 10.0, 0.002), np.arange(0.0, 9.9, 1.0 / 701.0)
    angle = np.floor(np.sin(1.5 * fine) / count) * count
    assert held(np.interp(time, fine, angle)) == 1.0
