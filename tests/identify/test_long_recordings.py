"""Recordings too long to be held: all of them is checked, and some parts are diagnosed."""

from dataclasses import replace
import json
import tracemalloc

from bench_recording import bench_recording, SERVO
from mcap.reader import make_reader
import numpy as np
import pyarrow
from pyarrow import csv, parquet
import pytest

from servo_identify.cli import main
from servo_identify.commands import import_table
from servo_identify.commands.online import followed
from servo_identify.data import import_in_parts, long_bags
from servo_identify.data.import_memory import memory_of
from servo_identify.data.long_bags import looked_at
from servo_identify.data.reading import open_one, read_looked_at, read_one
from servo_identify.data.recording_check import check
from servo_identify.data.survey import survey
from servo_identify.diagnose.checks import check as said_before
from servo_identify.diagnose.splitting import split
from servo_twin.bag import fits_in_memory, RecordingWriter
from servo_twin.description.servo_file import load
from servo_twin.recording import parts
from servo_twin.recording.recording import COMPARED

PART = 2000


@pytest.fixture(scope='module')
def motion():
    return bench_recording(2.0)


@pytest.fixture(autouse=True)
def _shorter(monkeypatch):
    monkeypatch.setattr(parts, 'SAMPLES', PART)
    monkeypatch.setattr(long_bags, 'LONGEST', 10 * PART)


def written(path, motion, count, moving=None):
    """Write a bag of ``count`` parts of one motion; all but those ``moving`` are at rest."""
    with RecordingWriter(path, 10) as bag:
        for k in range(count):
            columns = dict(motion.columns)
            if moving is not None and k not in moving:
                columns |= {name: np.full(len(motion), motion[name][0])
                            for name in ('motor_position', 'load_position')}
            bag.add(replace(motion, columns=columns, start=100.0 + 2.0 * k, sequence=PART * k))
    return path


def test_of_each_tenth_the_part_of_most_travel_is_taken(motion, tmp_path):
    moving = [0, 3, 5, 7, 8, 11, 13, 15, 16, 18]
    bag = written(tmp_path / 'bag', motion, 20, moving)
    taken = read_looked_at([bag], SERVO)
    assert [one.sequence // PART for one in taken] == moving
    assert taken[1].name == 'bag[6-8 s]'
    assert 'of its 20 parts of 2 s 10 are taken' in taken[0].warnings[-1]
    assert '20 s of 40 s are left' in taken[0].warnings[-1]
    assert not any(one.warnings for one in taken[1:])
    assert any('20 s of 40 s are left' in one for one in said_before(taken, load(SERVO)))
    np.testing.assert_array_equal(taken[2]['load_position'], motion['load_position'])


def test_a_recording_that_can_be_held_is_taken_whole(motion, tmp_path):
    one, = read_looked_at([written(tmp_path / 'bag', motion, 10)], SERVO)
    assert (len(one), one.name, one.warnings) == (10 * PART, 'bag', ())
    assert one.digest


def test_parts_of_one_bag_serve_in_turn(motion, tmp_path):
    taken = read_looked_at([written(tmp_path / 'bag', motion, 20)], SERVO)
    found = split(taken, [], [])
    number = {id(one): k for k, one in enumerate(taken)}
    assert [[number[id(one)] for one in several] for several in (
        found.screen, found.accept, found.report)] == [[0, 3, 4, 5, 8, 9], [1, 6], [2, 7]]
    assert 'parts of one bag' in found.warnings[0]


def test_a_check_looks_at_every_part(motion, tmp_path):
    servo = load(SERVO)
    still = set(range(20)) - {4, 13}
    bag = written(tmp_path / 'bag', motion, 20, {4, 13})
    with open_one(bag, SERVO) as opened:
        found = check([opened], servo)
        said, = (one.sentence for one in found if 'are taken' in one.sentence)
    assert f'nothing moves in {len(still)} of them' in said
    assert not any(one.level == 'red' for one in found)
    assert any(one.sentence == 'The inertia is excited.' for one in found)
    with open_one(written(tmp_path / 'still', motion, 12, ()), SERVO) as opened:
        assert [one.sentence for one in check([opened], servo) if one.level == 'red'] == [
            'still: nothing moves.']


def test_a_survey_in_parts_is_that_of_the_whole(motion, monkeypatch, tmp_path):
    columns = dict(motion.columns)
    columns['motor_position'] = np.round(100.0 * columns['motor_position'])
    columns['load_position'] = np.where(np.arange(PART) % 7, columns['load_position'], np.nan)
    columns['voltage'] = np.clip(100.0 * columns['voltage'], -24.0, 24.0)
    bag = written(tmp_path / 'bag', replace(motion, columns=columns), 8)
    servo = load(SERVO)
    with open_one(bag, SERVO) as opened:
        found = survey(opened, servo)
    monkeypatch.setattr(parts, 'SAMPLES', 8 * PART)
    with open_one(bag, SERVO) as opened:
        assert survey(opened, servo) == replace(found, parts=1)
    assert found.whole_numbers == ('motor_position',) and found.at_limit > 0.5
    assert found.lost['load_position'] == pytest.approx(1.0 / 7.0, abs=1e-3)


def looks_at_all(bag):
    with open_one(bag, SERVO) as opened:
        assert survey(opened, load(SERVO)).parts == len(opened) // PART
        assert len(looked_at(opened)) == 10


def tells_what_it_holds(bag):
    assert main(['info', str(bag), '--quiet']) == 0


def test_what_is_followed_online_in_parts_is_that_of_the_whole(motion, tmp_path):
    bag = written(tmp_path / 'bag', motion, 11)
    with open_one(bag, SERVO) as opened:
        found = followed(load(SERVO), opened, 5.0, 0.3)
    whole = followed(load(SERVO), read_one(bag), 5.0, 0.3)
    assert [one.sequence for one in found] == [one.sequence for one in whole]
    np.testing.assert_array_equal(found[-1].values, whole[-1].values)


def test_what_is_followed_online_is_read_part_by_part(motion, tmp_path, monkeypatch):
    bag, spans = written(tmp_path / 'bag', motion, 6), []
    with open_one(bag, SERVO) as opened:
        part = opened.part
        monkeypatch.setattr(opened, 'part', lambda *span: spans.append(span) or part(*span))
        followed(load(SERVO), opened, 5.0, 0.3)
    assert max(end - first for first, end in spans) <= PART
    assert spans[-1][1] == opened.sequence + 6 * PART


@pytest.mark.long
@pytest.mark.parametrize('looks', [looks_at_all, tells_what_it_holds])
def test_what_is_held_does_not_grow_with_the_bag(motion, tmp_path, looks):
    peaks = []
    for count in (11, 60, 240):
        bag = written(tmp_path / f'bag{count}', motion, count)
        tracemalloc.start()
        looks(bag)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.5 * peaks[1]  # held whole, it would be four times as much


def test_info_of_many_parts_is_that_of_the_whole(motion, tmp_path, capsys):
    bag = written(tmp_path / 'bag', motion, 4)
    main(['info', str(bag), '--json', '-'])
    one, = json.loads(capsys.readouterr().out)['recordings']
    assert one['samples'] == 4 * PART
    channel = one['channels']['load_position']
    assert channel['mean'] == pytest.approx(np.mean(motion['load_position']))
    assert channel['max'] == np.max(motion['load_position'])


def test_the_whole_of_what_is_in_memory_is_parted_alike(motion):
    whole = replace(motion, columns={
        name: np.tile(column, 20) for name, column in motion.columns.items()})
    assert [len(one) for one in looked_at(whole)] == [PART] * 10


def table_of(path, motion, count):
    """Write a table of so many motions, with counts, a hole and a unit; return the path."""
    long = replace(motion, columns={
        name: np.tile(column, count) for name, column in motion.columns.items()})
    columns = {'t': long.time, **{name: long[name] for name in COMPARED},
               'voltage': np.round(long['voltage']).astype(int),
               'coupled_position [deg]': np.where(np.arange(len(long)) % 7, long.time, np.nan)}
    table = pyarrow.table(columns)
    {'.csv': csv.write_csv, '.parquet': parquet.write_table}[path.suffix](table, path)
    return path


def samples_of_bag(bag):
    """Return all that a bag's messages hold, by topic."""
    found = {}
    with (bag / f'{bag.name}_0.mcap').open('rb') as file:
        for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
            found.setdefault(channel.topic, []).append(
                (message.log_time, message.sequence, message.data))
    return found


@pytest.mark.parametrize('suffix', ['csv', 'parquet'])
def test_an_import_in_parts_is_that_of_the_whole(motion, monkeypatch, tmp_path, capsys, suffix):
    path, told = table_of(tmp_path / f'table.{suffix}', motion, 3), []
    monkeypatch.setattr(import_in_parts, 'ROWS', 1234)
    monkeypatch.setattr(import_in_parts, '_BLOCK', 1 << 16)
    for least in (np.inf, 0.0):
        monkeypatch.setattr(import_table, 'IN_PARTS_FROM', least)
        out = tmp_path / str(least) / 'out'
        words = ['import', str(path), '--servo', str(SERVO), '-o', str(out), '--family', 'sine']
        assert main([*words, '--json', '-']) == 0
        said = capsys.readouterr()
        facts = json.loads(said.out)['recording']
        for channel in facts['channels'].values():
            channel['mean'] = pytest.approx(channel['mean'], rel=1e-12)
        told.append((samples_of_bag(out), facts | {'path': ''},
                     said.err.replace(str(out), 'out')))
    assert told[0] == told[1]
    assert 'is missing in' in told[0][2] and 'is converted to' in told[0][2]


@pytest.mark.parametrize('spoil', [
    lambda t: t + 0.3 * (np.arange(len(t)) > 3000), lambda t: np.where(t == t[5000], t[4999], t)],
    ids=['a hole', 'a time twice'])
def test_a_table_that_has_to_be_changed_is_imported_whole(motion, monkeypatch, tmp_path, spoil):
    long = {name: np.tile(motion[name], 3) for name in ('motor_position', 'voltage')}
    time = spoil(np.arange(3 * PART) * motion.period)
    csv.write_csv(pyarrow.table({'t': time, **long}), tmp_path / 'table.csv')
    monkeypatch.setattr(import_in_parts, '_BLOCK', 1 << 16)
    found = []
    for least in (np.inf, 0.0):
        monkeypatch.setattr(import_table, 'IN_PARTS_FROM', least)
        out = tmp_path / str(least) / 'out'
        assert main(['import', str(tmp_path / 'table.csv'), '--servo', str(SERVO), '-o',
                     str(out), '--quiet']) == 0
        found.append(samples_of_bag(out))
    assert found[0] == found[1]


def test_rows_of_machines_in_turn_are_refused_in_parts_too(motion, monkeypatch, tmp_path, capsys):
    number = np.tile([1, 2], PART)
    angle = np.where(number == 1, np.sin(1e-3 * np.arange(2 * PART)), 9.0)
    csv.write_csv(pyarrow.table({'t': 1e-3 * np.arange(2 * PART), 'id': number,
                                 'motor_position': angle}), tmp_path / 'table.csv')
    monkeypatch.setattr(import_table, 'IN_PARTS_FROM', 0.0)
    assert main(['import', str(tmp_path / 'table.csv'), '--servo', str(SERVO), '-o',
                 str(tmp_path / 'out')]) == 2
    assert 'several machines in turn' in capsys.readouterr().err


def test_an_import_in_parts_holds_no_more_of_a_longer_table(motion, monkeypatch, tmp_path):
    monkeypatch.setattr(import_table, 'IN_PARTS_FROM', 0.0)
    monkeypatch.setattr(import_in_parts, 'LOOKED_AT', 1000)
    monkeypatch.setattr(import_in_parts, '_BLOCK', 1 << 18)
    peaks = []
    for count in (3, 12):
        path = table_of(tmp_path / f'table{count}.csv', motion, count)
        tracemalloc.start()
        assert main(['import', str(path), '--servo', str(SERVO), '-o',
                     str(tmp_path / f'out{count}'), '--quiet']) == 0
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]


@pytest.mark.parametrize('suffix', ['csv', 'parquet', 'mcap'])
def test_an_import_says_the_memory_that_it_takes_before_it_starts(motion, monkeypatch, tmp_path,
                                                                  capsys, suffix):
    whole = replace(motion, columns={
        name: np.tile(column, 15) for name, column in motion.columns.items()})
    path, words = tmp_path / f'table.{suffix}', []
    if suffix == 'mcap':
        path = written(tmp_path / 'bag', motion, 15)
        (tmp_path / 'map.yaml').write_text(
            'time: {source: /encoder.stamp}\ncolumns:\n'
            '  motor_position: {source: "/encoder.motor_position[0]"}\n')
        words = ['--mapping', str(tmp_path / 'map.yaml')]
    else:
        table = pyarrow.table({'t': whole.time, **{
            name: whole[name] for name in (*COMPARED, 'voltage')}})
        {'csv': csv.write_csv, 'parquet': parquet.write_table}[suffix](table, path)
    words = ['import', str(path), '--servo', str(SERVO), *words]
    monkeypatch.setattr(import_table, 'SAID_FROM', 0)
    main([*words, '-o', str(tmp_path / 'warm')])
    capsys.readouterr()
    tracemalloc.start()
    assert main([*words, '-o', str(tmp_path / 'out')]) == 0
    took = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 'is held whole while it is imported' in capsys.readouterr().err
    assert 0.3 * took < memory_of(path) < 3.0 * took
    monkeypatch.setattr(fits_in_memory, 'free_memory', lambda: 0.5 * memory_of(path))
    assert main([*words, '-o', str(tmp_path / 'more')]) == 2
    assert 'GiB are free; part the table' in capsys.readouterr().err
