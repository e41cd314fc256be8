"""Several recordings in one file: episodes of LeRobot, demonstrations of robomimic, runs."""

import json

import h5py
import numpy as np
import pyarrow as pa
from pyarrow import parquet
import pytest
from small_tables import convert, SERVO, table, TIME, write_csv

import servo_identify as si
from servo_identify.commands import import_table as command
from servo_identify.data.reading import read_looked_at, read_recordings
from servo_identify.data.table_import import import_table
from servo_twin.bag import read_recording

FIRST = np.arange(200) < 120


def episodes(path, name='episode_index', numbers=(3, 4), **columns):
    """Write two episodes, of 120 and 80 rows, and return the path."""
    parquet.write_table(pa.table(table(**columns) | {
        name: np.where(FIRST, *numbers)}), path)
    return path


@pytest.mark.parametrize('times', [TIME, np.where(FIRST, TIME, TIME - TIME[120])])
def test_each_episode_is_a_recording_whether_its_times_go_on_or_not(tmp_path, times):
    for read in (read_recordings, read_looked_at):
        one, two = read([episodes(tmp_path / 'a.parquet', t=times)], SERVO)
        assert (one.name, two.name) == ('a_episode_3', 'a_episode_4')
        assert np.array_equal(one['motor_position'], TIME[FIRST]**2)
        assert np.array_equal(two['motor_position'], TIME[~FIRST]**2)


@pytest.mark.parametrize('name, numbers', [('run', (1, 2)), ('trial_id', (0, 1)),
                                           ('Episode', (0, 1))])
def test_a_column_that_numbers_runs_is_known_by_its_name(tmp_path, name, numbers):
    assert len(read_recordings([episodes(tmp_path / 'a.parquet', name, numbers)], SERVO)) == 2


def test_runs_that_have_texts_for_names_are_numbered(tmp_path):
    data = episodes(tmp_path / 'a.parquet', 'trial', ('slow', 'fast'))
    one, two = read_recordings([data], SERVO)
    assert (one.name, len(one), two.name, len(two)) == ('a_trial_1', 120, 'a_trial_2', 80)


@pytest.mark.parametrize('name, numbers', [('run', (0, 1)), ('state', (0, 1)),
                                           ('episode_index', (2, 2))])
def test_a_flag_and_a_single_number_part_nothing(tmp_path, name, numbers):
    one, = read_recordings([episodes(tmp_path / 'a.parquet', name, numbers)], SERVO)
    assert len(one) == 200


@pytest.mark.parametrize('least', [0.0, 2.0**40])
def test_import_makes_a_bag_of_each_run_and_counts_the_replicates(tmp_path, monkeypatch, capsys,
                                                                  least):
    monkeypatch.setattr(command, 'IN_PARTS_FROM', least)
    data = write_csv(tmp_path / 'a.csv', table(run=np.where(FIRST, 1, 2)))
    for force in ((), ('--force',)):
        assert convert(data, tmp_path / 'bags', '--family', 'x', '--replicate', '1', '--json', '-',
                       *force) == 0
        said = json.loads(capsys.readouterr().out)
        assert [one['samples'] for one in said['recordings']] == [120, 80]
    two = read_recording(tmp_path / 'bags' / 'a_run_2')
    assert (len(two), two.family, two.replicate) == (80, 'x', 2)


def test_a_run_takes_its_family_from_the_listing_beside_it(tmp_path):
    (tmp_path / 'recordings.yaml').write_text(
        'a.parquet: {family: slow, replicate: 1}\na_episode_4: {family: fast, replicate: 7}\n')
    found = read_recordings([episodes(tmp_path / 'a.parquet')], SERVO)
    assert [(one.family, one.replicate) for one in found] == [('slow', 1), ('fast', 7)]


def test_who_wants_one_recording_is_told_that_there_are_several(tmp_path):
    with pytest.raises(ValueError, match='2 recordings, a_episode_3 to a_episode_4'):
        import_table(episodes(tmp_path / 'a.parquet'), SERVO)


def test_what_is_wrong_with_a_run_says_which_run(tmp_path):
    spoilt = np.where(FIRST, TIME, np.abs(TIME - 0.7 * TIME.max()))
    with pytest.raises(ValueError, match=r'backwards.*\(episode_4\)'):
        read_recordings([episodes(tmp_path / 'a.parquet', t=spoilt)], SERVO)


NUMBERS = np.repeat([0, 1, 2], [1, 119, 80])
SHORT = 'a.csv: episode_0 has 1 row and is left out; a recording needs 2'


def test_a_run_that_is_too_short_is_left_out_by_name_and_the_others_go_on(tmp_path, capsys):
    data = write_csv(tmp_path / 'a.csv', table(episode=NUMBERS))
    one, two = read_recordings([data], SERVO)
    assert (one.name, len(one), two.name, len(two)) == ('a_episode_1', 119, 'a_episode_2', 80)
    assert SHORT in one.warnings
    assert convert(data, tmp_path / 'bags', '--replicate', '1', '--json', '-') == 1
    said = capsys.readouterr()
    assert json.loads(said.out)['left_out'] == {'a.csv, episode_0': SHORT} and SHORT in said.err
    assert read_recording(tmp_path / 'bags' / 'a_episode_2').replicate == 3


def test_of_columns_in_memory_a_short_run_is_left_out_too():
    one, _ = si.read(table(episode=NUMBERS), SERVO, name='mine').items
    assert any('episode_0 has 1 row and is left out' in said for said in one.warnings)


def test_a_single_run_that_is_long_enough_is_a_bag_in_the_folder(tmp_path):
    data = write_csv(tmp_path / 'a.csv', table(episode=np.where(np.arange(200) < 1, 0, 1)))
    assert convert(data, tmp_path / 'bags') == 1
    assert len(read_recording(tmp_path / 'bags' / 'a_episode_1')) == 199


def test_where_all_runs_are_too_short_the_file_is_refused(tmp_path):
    data = write_csv(tmp_path / 'a.csv', {name: column[:2] for name, column in table(
        episode=NUMBERS).items()})
    with pytest.raises(ValueError, match='a recording needs two'):
        read_recordings([data], SERVO)


def test_columns_in_memory_are_parted_alike():
    data = si.read(table(episode_index=np.where(FIRST, 0, 1)), SERVO, name='mine')
    assert [(one.name, len(one)) for one in data] == [('mine_episode_0', 120),
                                                      ('mine_episode_1', 80)]


def robomimic(path, lengths=(120, 80)):
    """Write demonstrations as robomimic has them: no times, joints in one array."""
    with h5py.File(path, 'w') as file:
        for k, rows in enumerate(lengths):
            one = file.create_group(f'data/demo_{k}')
            one['actions'] = np.sin(TIME[:rows, None])
            one['obs/joint_pos'] = np.stack([TIME[:rows]**2, TIME[:rows]], 1)
    return path


def test_demonstrations_in_groups_are_recordings_of_rows_that_are_counted(tmp_path):
    (tmp_path / 'm.yaml').write_text('time: {every: 0.02}\ncolumns:\n'
                                     '  motor_position: {source: "obs.joint_pos[0]"}\n'
                                     '  voltage: {source: actions}\n')
    one, two = read_recordings([robomimic(tmp_path / 'a.hdf5')], SERVO, tmp_path / 'm.yaml')
    assert (one.name, len(one), two.name, len(two)) == ('a_demo_0', 120, 'a_demo_1', 80)
    assert one.period == two.period == pytest.approx(0.02)
    assert np.array_equal(two['motor_position'], TIME[:80]**2)


def test_groups_of_joints_stay_in_one_recording(tmp_path):
    np.savez(tmp_path / 'a.npz', **{f'joint{k}.pos': TIME for k in range(2)})
    with pytest.raises(ValueError, match=r'joint0\.pos.*joint1\.pos'):
        read_recordings([tmp_path / 'a.npz'], SERVO)
