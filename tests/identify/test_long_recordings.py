"""Recordings too long to be held: all of them is checked, and some parts are diagnosed."""

from dataclasses import replace
import json
import tracemalloc

from bench_recording import bench_recording, SERVO
import numpy as np
import pyarrow
from pyarrow import csv, parquet
import pytest

from servo_identify.cli import main
from servo_identify.commands import import_table
from servo_identify.data import long_bags
from servo_identify.data.check import check
from servo_identify.data.import_memory import memory_of
from servo_identify.data.long_bags import looked_at
from servo_identify.data.reading import open_one, read_looked_at
from servo_identify.data.survey import survey
from servo_identify.diagnose.checks import check as said_before
from servo_identify.diagnose.splitting import split
from servo_twin.bag import memory, RecordingWriter
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
    monkeypatch.setattr(memory, 'free_memory', lambda: 0.5 * memory_of(path))
    assert main([*words, '-o', str(tmp_path / 'more')]) == 2
    assert 'GiB are free; part the table' in capsys.readouterr().err
