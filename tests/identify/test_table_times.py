"""Times of a table: their unit, jitter, lost rows, holes and jumps."""

import re

import numpy as np
import pytest
from small_tables import SERVO, table, TIME, write_csv

from servo_identify.cli import main
from servo_identify.data.reading import read_recordings
from servo_identify.data.recording_check import check
from servo_identify.data.stretch import Stretch
from servo_identify.data.table_import import import_table
from servo_identify.data.time_units import WORDS
from servo_twin.bag import read_recording
from servo_twin.description.servo_file import load


@pytest.mark.parametrize('rows, refused', [(2, False), (5, True)])
def test_stamps_that_are_coarser_than_the_rows_are_refused_above_a_half(tmp_path, rows, refused):
    path = write_csv(tmp_path / 'a.csv', table(t=TIME // (rows * 1e-3) * rows * 1e-3))
    if refused:
        with pytest.raises(ValueError, match='coarser than the rows. Write .* with more digits'):
            import_table(path, SERVO)
    else:
        assert len(import_table(path, SERVO)) < 120


@pytest.mark.parametrize('time, unit', [
    (1e9 * TIME, 'ns'), (1e3 * TIME, 'ms'), (1e6 * TIME, 'us'),
    (45_352.4 + 2.0 * TIME / 86_400.0, 'days')])
def test_it_asks_for_the_unit_of_the_time_that_its_size_tells(tmp_path, time, unit):
    path = write_csv(tmp_path / 'a.csv', table(t=time))
    recording = import_table(path, SERVO)
    told = next((one.sentence for one in check([recording], load(SERVO))
                 if one.level == 'red'), '')
    assert f'for a servo; the time may be in {WORDS[unit]}.' in told
    assert unit == 'ms' or f'is t in {unit}?' in recording.note


def test_a_clock_that_jumps_by_years_is_no_pause_of_the_logger(tmp_path):
    time = np.arange(100) * 2e-3
    time[50:] += 1.7e9
    path = write_csv(tmp_path / 'a.csv', {'t': time, 'voltage': time, 'motor_position': time})
    with pytest.raises(ValueError, match=r'time jumps from 0.098 s in row 50 to 1.7e\+09'):
        import_table(path, SERVO)


def test_it_resamples_measurements_linearly_and_commands_by_the_mean_of_what_they_hold(tmp_path):
    random = np.random.default_rng(4)
    time = np.cumsum(random.uniform(4e-3, 6e-3, 400))
    columns = {'t': time, 'voltage': np.arange(400.0), 'motor_position': 3.0 * time + 1.0}
    recording = import_table(write_csv(tmp_path / 'a.csv', columns), SERVO, period=2e-3)
    grid = recording.start + recording.time
    assert recording.period == 2e-3 and 'resampled to 0.002 s' in recording.warnings[0]
    assert np.allclose(recording['motor_position'], 3.0 * grid + 1.0)
    within = grid[:, None] + 2e-3 * (np.arange(1000) + 0.5) / 1000
    held = np.searchsorted(time, within, 'right') - 1
    assert np.allclose(recording['voltage'], held.mean(axis=1), atol=2e-3)


def test_it_makes_nothing_up_across_a_hole(tmp_path):
    keep = (TIME < 0.05) | (TIME > 0.15)
    recording = import_table(write_csv(tmp_path / 'a.csv', {
        name: column[keep] for name, column in table().items()}), SERVO)
    assert len(recording) == 200 and recording.period == pytest.approx(1e-3)
    lost = np.isnan(recording['motor_position'])
    assert 100 <= lost.sum() <= 102 and np.isnan(recording['voltage'][lost]).all()
    assert any('holes of more than 3 periods' in warning for warning in recording.warnings)


def test_times_that_are_even_but_for_a_hole_are_not_called_uneven(tmp_path):
    kept = np.r_[0:800, 1200:2000]
    columns = {'t': np.round(2e-3 * kept, 3), 'voltage': np.ones(len(kept)),
               'motor_position': 1e-3 * kept}
    recording = import_table(write_csv(tmp_path / 'a.csv', columns), SERVO)
    assert recording.warnings == ('400 rows lie in holes of more than 3 periods, the first at '
                                  't = 1.6 s; they are NaN',)
    assert not recording.resampled and recording.period == 0.002


def test_jitter_and_lost_rows_leave_the_period_what_it_was(tmp_path):
    random = np.random.default_rng(5)
    time = (TIME + random.uniform(-2e-5, 2e-5, 200))[random.random(200) > 0.05]
    columns = {'t': time, 'voltage': time, 'motor_position': time}
    assert import_table(write_csv(tmp_path / 'a.csv', columns), SERVO).period == pytest.approx(
        1e-3, rel=5e-4)


def test_a_lost_row_leaves_the_others_as_they_are_though_their_stamps_jitter(tmp_path):
    chance, kept = np.random.default_rng(1), np.delete(np.arange(4000), [100, 101, 2000])
    time = 1e-3 * np.arange(4000) + 2e-6 * chance.standard_normal(4000)
    columns = {'t': time, 'voltage': np.ones(4000), 'motor_position': chance.normal(size=4000)}
    recording = import_table(write_csv(tmp_path / 'a.csv', {
        name: column[kept] for name, column in columns.items()}), SERVO)
    assert recording.period == 1e-3 and len(recording) == 4000
    assert np.array_equal(recording['motor_position'][kept], columns['motor_position'][kept])


def test_a_hole_of_three_periods_is_filled_wherever_it_is(tmp_path):
    kept = np.delete(np.arange(6000), [1234, 1235, 4000, 4001, 5000, 5001])
    columns = {'t': np.round(1e-3 * kept, 3), 'voltage': np.ones(len(kept)),
               'motor_position': 1e-3 * kept}
    recording = import_table(write_csv(tmp_path / 'a.csv', columns), SERVO)
    assert not any('holes' in warning for warning in recording.warnings)
    assert np.allclose(recording['motor_position'], 1e-3 * np.arange(6000))


@pytest.mark.parametrize('rate', [3.0, 30.0])
def test_it_says_how_far_a_line_between_uneven_rows_may_be_off(tmp_path, rate):
    random = np.random.default_rng(4)
    time = np.cumsum(random.uniform(4e-3, 6e-3, 400))
    columns = {'t': time, 'voltage': time, 'motor_position': np.sin(rate * time),
               'current': 0.0 * time}
    recording = import_table(write_csv(tmp_path / 'a.csv', columns), SERVO, period=2e-3)
    off = np.abs(recording['motor_position'] - np.sin(rate * (recording.start + recording.time)))
    said = recording.warnings[0].split('in shares of the range, by ')[1]
    assert said.endswith('% of motor_position')
    assert np.max(off) / 2.0 == pytest.approx(float(said.split()[0]) / 100.0, rel=0.5)


def test_even_times_cost_nothing(tmp_path):
    recording = import_table(write_csv(tmp_path / 'a.csv', table()), SERVO)
    assert 'of the range' not in ' '.join(recording.warnings)


@pytest.mark.parametrize(('name', 'stamps', 'begin'), [
    ('t', [f'2026-11-26 14:03:{12 + 2e-3 * k:06.3f}' for k in range(50)],
     '2026-11-26 14:03:12.000'),
    ('t [s]', [f'{1795701792 + 2e-3 * k:.3f}' for k in range(50)], '2026-11-26 14:03:12.000 UTC'),
    ('t', [str(1795701792 * 10**9 + 2 * 10**6 * k) for k in range(50)],
     '2026-11-26 14:03:12.000 UTC'),
    ('t', [str((1795701792 + 11644473600) * 10**7 + 20000 * k) for k in range(50)],
     '2026-11-26 14:03:12.000 UTC'), ('t', [f'{2e-3 * k:.3f}' for k in range(50)], '')])
def test_the_note_keeps_when_a_recording_began(tmp_path, name, stamps, begin):
    path = tmp_path / 'a.csv'
    path.write_text(f'{name},voltage,motor_position\n' + ''.join(
        f'{one},{k},{0.1 * k}\n' for k, one in enumerate(stamps)))
    recording = import_table(path, SERVO)
    assert recording.period == pytest.approx(2e-3)
    assert (f'the first row is of {begin}' in recording.note) if begin else (
        'first row is of' not in recording.note)


@pytest.mark.parametrize(('hours', 'words'), [(-1, 'set back by an hour.*add 3600 s'),
                                              (1, 'set forward by an hour.*subtract 3600 s'),
                                              (30, 'mend the clock')])
def test_a_clock_that_daylight_saving_sets_is_named(tmp_path, hours, words):
    time = 0.01 * np.arange(400)
    time[200:] += 3600.0 * hours
    path = write_csv(tmp_path / 'a.csv', {'t': time, 'voltage': time, 'motor_position': time})
    with pytest.raises(ValueError, match=words):
        import_table(path, SERVO)


@pytest.mark.parametrize('hours', [1, 30])
def test_one_side_of_a_clock_that_was_set_forward_is_taken_as_the_refusal_says(tmp_path, hours):
    time = 0.01 * np.arange(400)
    time[200:] += 3600.0 * hours
    path = write_csv(tmp_path / 'a.csv', {'t': 100.0 + time, 'voltage': time,
                                          'motor_position': time})
    with pytest.raises(ValueError, match=r'[Tt]ake one side of it \(--to') as refused:
        import_table(path, SERVO)
    at, other = re.findall(r'--(?:to|from) ([\d.]+)', str(refused.value))
    assert at == other
    words = ['import', str(path), '--servo', str(SERVO), '-o']
    for bag, side, motion in ((tmp_path / 'before', '--to', time[:200]),
                              (tmp_path / 'behind', '--from', time[200:])):
        assert main([*words, str(bag), side, at]) == 0
        assert read_recording(bag)['motor_position'].tolist() == motion.tolist()
    one, = read_recordings([path], SERVO, stretch=Stretch(3600.0 * hours + 2.5))
    assert (one.name, len(one)) == (f'a[{3600 * hours + 2.5:.6g}-{3600 * hours + 4:.6g} s]', 150)
    with pytest.raises(ValueError, match=rf'in row 200 to .* in row 201.*--to {at} or'):
        read_recordings([path], SERVO, stretch=Stretch(0.5))
    with pytest.raises(ValueError, match='a: from 5 s to 6 s there is nothing'):
        read_recordings([path], SERVO, stretch=Stretch(5.0, 6.0))


def test_a_stamp_with_a_zone_is_told_in_utc(tmp_path):
    import pyarrow
    from pyarrow import parquet

    stamps = pyarrow.array([1732780000000000 + 2000 * k for k in range(50)]).cast(
        pyarrow.timestamp('us', tz='Europe/Berlin'))
    parquet.write_table(pyarrow.table({'t': stamps, 'motor_position': [0.1 * k for k in range(
        50)]}), tmp_path / 'a.parquet')
    recording = import_table(tmp_path / 'a.parquet', None)
    assert 'the first row is of 2024-11-28 07:46:40.000000 UTC' in recording.note
    assert recording.period == pytest.approx(0.002)
