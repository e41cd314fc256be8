"""Which files a name stands for, and what their recordings are called."""

import bz2
import gzip
import lzma
from pathlib import Path

import numpy as np
import pytest
from small_tables import SERVO, write_csv

import servo_identify as si
from servo_identify.cli import main
from servo_identify.data.named_files import files_of, names_apart
from servo_identify.data.reading import read_looked_at, read_recordings

PACKERS = {'.gz': gzip, '.bz2': bz2, '.xz': lzma}


def table(travel=1.0):
    time = 0.002 * np.arange(400)
    angle = travel * np.sin(5.0 * time)
    return {'t': time, 'voltage': np.cos(time), 'motor_position': angle}


def packed(path, kind, columns):
    """Write a table and pack it."""
    text = write_csv(path, columns).read_bytes()
    path.unlink()
    with PACKERS[kind].open(f'{path}{kind}', 'wb') as file:
        file.write(text)


def test_a_folder_stands_for_its_tables_packed_or_not_and_for_its_bags(tmp_path):
    for number, kind in enumerate(PACKERS, 1):
        packed(tmp_path / f'run_{number}.csv', kind, table())
    write_csv(tmp_path / 'run_4.csv', table())
    write_csv(tmp_path / '._run_4.csv', table())
    (tmp_path / 'recordings.yaml').write_text('run_2: {family: sine}')
    assert main(['import', str(tmp_path / 'run_4.csv'), '--servo', str(SERVO), '-o',
                 str(tmp_path / 'run_5')]) == 0
    found = read_recordings([tmp_path], SERVO)
    assert [one.name for one in found] == [f'run_{number}' for number in range(1, 6)]
    assert [one.family for one in found] == ['', 'sine', '', '', '']
    assert [one.name for one in si.read(tmp_path, SERVO)] == [one.name for one in found]
    assert main(['import', str(tmp_path), '--servo', str(SERVO), '-o',
                 str(tmp_path / 'new')]) == 1  # a bag of ours needs no import
    assert sorted(one.name for one in (tmp_path / 'new').iterdir()) == [
        'run_1', 'run_2', 'run_3', 'run_4']


def test_a_folder_that_holds_nothing_says_where_there_is_something(tmp_path):
    with pytest.raises(ValueError, match='is a folder without a bag or a table$'):
        read_recordings([tmp_path], SERVO)
    (tmp_path / 'monday').mkdir()
    write_csv(tmp_path / 'monday' / 'run.csv', table())
    with pytest.raises(ValueError, match='named by them, such as .*monday$'):
        read_recordings([tmp_path], SERVO)


def test_a_file_that_is_named_in_two_ways_is_read_once(tmp_path, monkeypatch):
    path = write_csv(tmp_path / 'run.csv', table())
    monkeypatch.chdir(tmp_path)
    assert files_of(['run.csv', path, tmp_path, '*.csv']) == [Path('run.csv')]


@pytest.mark.parametrize('named', ['', ' ', 'a\0b'])
def test_a_name_that_is_none_is_refused_in_a_sentence(named):
    with pytest.raises(ValueError, match='names no file; give a bag'):
        files_of([named])


def test_recordings_of_one_name_are_told_apart_by_their_folders(tmp_path):
    for folder in 'ab':
        (tmp_path / folder).mkdir()
        write_csv(tmp_path / folder / 'run.csv', table())
    write_csv(tmp_path / 'a' / 'other.csv', table())
    found = read_recordings([tmp_path / 'a', tmp_path / 'b'], SERVO)
    assert [one.name for one in found] == ['other', 'a_run', 'b_run']
    (accepting,) = read_looked_at([tmp_path / 'b'], SERVO, beside=[tmp_path / 'a'])
    assert accepting.name == 'b_run'
    assert names_apart([Path('a/run.csv'), Path('a/run.mat'), Path('b/go.csv')],
                       ['run', 'run', 'go']) == ['run_csv', 'run_mat', 'go']


def test_a_finding_names_one_of_two_recordings_that_were_read_apart(tmp_path):
    for folder, travel in (('a', 1.0), ('b', 0.0)):
        (tmp_path / folder).mkdir()
        write_csv(tmp_path / folder / 'run.csv', table(travel))
    one, two = (si.read(tmp_path / folder, SERVO)[0] for folder in 'ab')
    assert one.name == two.name == 'run'
    assert 'run (2): nothing moves' in repr(si.check([one, two], SERVO))


@pytest.mark.parametrize(('held', 'words'), [
    ({}, 'table has no columns: give them by name'), ([], 'an empty list, as of a pattern'),
    ([{}], 'table_1 has no columns'), ('', 'names no file'),
    ({'t': 5.0}, "'t' is one number, and a column has one for each sample"),
    ({'x': [1.0, 2.0]}, "has no column t; it has .*The time in s is 't'")])
def test_what_is_empty_is_refused_in_a_sentence_that_says_what_to_give(held, words):
    with pytest.raises(ValueError, match=words) as said:
        si.read(held, SERVO)
    assert 'servo-identify init' not in str(said.value)
