"""Bags of any length: what is held does not grow with them, and no part changes the answer."""

import tracemalloc

from bench_recording import bench_recording, SERVO, without
import numpy as np
import pytest

from servo_twin.bag import (
    BagError,
    BagWriter,
    open_recording,
    read_predictions,
    read_recording,
    RecordingWriter,
    Samples,
    write_recording,
)
from servo_twin.cli import main
from servo_twin.description.servo_file import load
from servo_twin.lockstep.lockstep import Settings
from servo_twin.lockstep.whole_recording import answer, Answering
from servo_twin.pages.envelopes import Envelopes
from servo_twin.recording import parts
from servo_twin.recording.recording import COLUMNS


@pytest.fixture(scope='module')
def minute():
    return bench_recording(60.0)


def repeated(path, minute, times):
    """Write a bag of so many minutes, each the same motion."""
    with RecordingWriter(path, 10) as bag:
        for k in range(times):
            bag.add(type(minute)(
                'long', minute.period, dict(minute.columns), start=100.0 + 60.0 * k,
                servo=minute.servo, servo_file=minute.servo_file, sequence=60_000 * k))
    return path


def peak_of(action):
    """Return the most bytes that an action held at once."""
    tracemalloc.start()
    try:
        action()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def same(one, other):
    return all(np.array_equal(one[name], other[name], equal_nan=True) for name in one)


def test_what_a_replay_holds_does_not_grow_with_the_bag(minute, tmp_path):
    main(['replay', str(repeated(tmp_path / 'warm', minute, 1)), '--quiet'])
    peaks = []
    for times in (3, 12):
        bag = repeated(tmp_path / f'bag{times}', minute, times)
        peaks.append(peak_of(lambda bag=bag, times=times: main(
            ['replay', str(bag), '-o', str(tmp_path / f'out{times}'), '--quiet',
             '--page', str(tmp_path / f'{times}.html')])))
    assert peaks[1] < 1.5 * peaks[0]  # held whole, it would be four times as much
    assert len(read_predictions(tmp_path / 'out12')) == 12 * 60_000
    assert (tmp_path / '12.html').stat().st_size < 1.5 * (tmp_path / '3.html').stat().st_size


@pytest.mark.parametrize('mode', ['measured_input', 'closed_loop'])
def test_how_a_recording_is_cut_changes_no_bit_of_its_answer(monkeypatch, tmp_path, mode):
    servo, recording = load(SERVO), bench_recording(4.0, coulomb=30.0)
    for lost in (slice(500, 520), slice(990, 1010), slice(1400, 3100), slice(3999, 4000)):
        recording = without(recording, lost)
    settings = Settings(mode=mode)
    whole = answer(recording, servo, settings)
    bag = write_recording(tmp_path / 'bag', recording, 10)
    monkeypatch.setattr(parts, 'SAMPLES', 300)
    with open_recording(bag) as opened:
        line = Answering(opened, servo, settings)
        found = list(line)
    assert [len(part) for part, _ in found] == [300] * 13 + [100]
    assert line.warnings == whole.warnings and line.restarts == whole.restarts == 1
    for part, answered in found:
        cut = whole.part(part.sequence, part.sequence + len(part))
        assert same(answered.prediction, cut.prediction) and same(answered.residual, cut.residual)
        assert answered.start == pytest.approx(cut.start, abs=1e-9)


def test_a_long_hole_does_not_keep_what_was_before_it(monkeypatch):
    servo, recording = load(SERVO), without(bench_recording(4.0), slice(900, 3500))
    monkeypatch.setattr(parts, 'SAMPLES', 300)
    line = iter(Answering(recording, servo))
    taken, seen = [], recording.part
    monkeypatch.setattr(type(recording), 'part', lambda self, first, end: (
        taken.append(first - recording.sequence), seen(first, end))[1])
    for part, _ in line:
        ahead = taken[-1] - (part.sequence - recording.sequence)
        assert ahead <= 300  # one part late, also where thousands of samples are missing


def test_any_part_of_a_bag_is_that_of_the_whole(tmp_path):
    recording = bench_recording(2.0)
    bag = write_recording(tmp_path / 'bag', recording, 7)
    with open_recording(bag) as opened:
        assert (len(opened), opened.sequence) == (2000, 17)
        for first, end in ((17, 18), (400, 1733), (1990, 5000), (0, 20), (3000, 4000)):
            part, wanted = opened.part(first, end), recording.part(first, end)
            assert part.sequence == wanted.sequence and len(part) == len(wanted)
            assert same(part.columns, wanted.columns)
            assert part.start == pytest.approx(wanted.start, abs=1e-9)


def test_a_bag_written_in_parts_reads_as_one_written_whole(monkeypatch, tmp_path):
    recording = bench_recording(2.0)
    with RecordingWriter(tmp_path / 'parts', 10) as bag:
        for first in range(0, 2000, 130):
            bag.add(recording.part(17 + first, 17 + first + 130))
    monkeypatch.setattr(parts, 'SAMPLES', 251)
    again = read_recording(tmp_path / 'parts')
    assert same(again.columns, recording.columns)
    assert (again.sequence, again.warnings) == (17, ())
    assert again.start == pytest.approx(recording.start, abs=1e-9)


def chunk_of(bag, topic, message, numbers):
    """Write one chunk of one-sample messages with these running numbers; fields are the number."""
    names = {'Encoder': ('motor_position', 'load_position'), 'Current': ('current',)}[message]
    column = np.asarray(numbers, float)[:, None]
    bag._channel(topic, message)
    bag._file.write_chunk([bag._records(
        topic, Samples(message, dict.fromkeys(names, column)), np.asarray(numbers),
        np.asarray(numbers) * 10**6, 1e-3)])


@pytest.mark.parametrize('third', [
    [*range(200, 250), 250, 250, *range(252, 300)], [*range(200, 298), 298, 298],
    [*range(200, 240), *range(239, 250), *range(251, 300)]])
def test_a_chunk_that_lacks_what_it_has_twice_is_seen(tmp_path, third):
    with BagWriter(tmp_path / 'bag') as bag:
        for begin in range(0, 600, 100):
            numbers = third if begin == 200 else range(begin, begin + 100)
            chunk_of(bag, 'encoder', 'Encoder', numbers)
            chunk_of(bag, 'current', 'Current', range(begin, begin + 100))
    again = read_recording(tmp_path / 'bag')
    lost = sorted({*range(600)} - {*third, *range(200), *range(300, 600)})
    wanted = np.arange(600.0)
    wanted[lost] = np.nan
    np.testing.assert_array_equal(again['motor_position'], wanted)
    np.testing.assert_array_equal(again['current'], np.arange(600.0))
    assert any('1 samples are there twice' in one for one in again.warnings)
    assert any(f'1 samples lost in 1 gaps, the first at sequence {lost[0]}' in one
               for one in again.warnings)


def test_time_that_runs_backwards_within_a_chunk_is_named(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        for begin in range(0, 600, 100):
            chunk_of(bag, 'encoder', 'Encoder', range(begin, begin + 100))
            times = np.arange(begin, begin + 100)
            if begin == 200:
                times[50] = 100
            bag._channel('current', 'Current')
            bag._file.write_chunk([bag._records(
                'current', Samples('Current', {'current': times[:, None] * 1.0}),
                np.arange(begin, begin + 100), times * 10**6, 1e-3)])
    with pytest.raises(BagError, match='time runs backwards from 0.249000000 s at sequence 249'):
        read_recording(tmp_path / 'bag')


def test_a_replay_that_cannot_be_leaves_no_bag(tmp_path, capsys):
    recording = bench_recording(0.5)
    columns = {**recording.columns, 'voltage': np.full(len(recording), np.nan)}
    bag = write_recording(tmp_path / 'bag', type(recording)(
        'still', recording.period, columns, servo_file=recording.servo_file))
    assert main(['replay', str(bag), '-o', str(tmp_path / 'out')]) == 2
    assert 'voltage was not recorded' in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


def test_only_what_is_held_whole_must_fit_into_the_memory(monkeypatch, tmp_path):
    from servo_twin.bag import fits_in_memory
    bag = write_recording(tmp_path / 'bag', type(bench_recording(0.1))(
        'long', 1e-3, {name: np.zeros(200_000) for name in COLUMNS}))
    monkeypatch.setattr(fits_in_memory, 'free_memory', lambda: 1.5e7)
    with pytest.raises(BagError, match='GiB are free'):
        read_recording(bag)
    with open_recording(bag) as opened:
        assert sum(len(part) for part in parts.parts_of(opened)) == 200_000


def test_an_envelope_keeps_the_extremes_and_what_is_unknown():
    random = np.random.default_rng(3)
    values = random.standard_normal(100_000)
    values[20_000:50_000] = np.nan
    values[70_000] = 9.0
    curves = Envelopes(len(values))
    for first in range(0, len(values), 777):
        curves.add('one', first, values[first:first + 777])
    drawn, times = curves.curve('one'), curves.times(1e-3)
    assert len(drawn) == len(times) <= 2 << 15
    assert np.nanmax(drawn) == 9.0 and np.nanmin(drawn) == np.nanmin(values)
    assert abs(times[np.nanargmax(drawn)] - 70.0) < 0.01
    assert np.isnan(drawn[(times > 20.01) & (times < 49.99)]).all()
    short = Envelopes(50)
    short.add('one', 0, values[:50])
    np.testing.assert_array_equal(short.curve('one'), values[:50])
    np.testing.assert_array_equal(short.times(0.5), 0.5 * np.arange(50))
