"""A bag as the source of the view: it ..."""

from dataclasses import replace
import tracemalloc

from bench_recording import bench_recording, SERVO
import numpy as np
import pytest

from servo_twin.bag import RecordingWriter, write_predictions, write_recording
from servo_twin.description.servo_file import load
from servo_twin.lockstep.whole_recording import answer
from servo_twin.recording import parts
from servo_twin.recording.joined_samples import CHANNELS
from servo_twin.recording.recording import BALANCES, COMPARED, PREDICTED
from servo_twin.view.played_bag import PlayedBag


@pytest.fixture(scope='module')
def recording():
    return bench_recording(2.0)


@pytest.mark.parametrize('live', [True, False], ids=['as it was live', 'by a twin of its own'])
def test_it_shows_all_that_was_recorded_and_answered_part_by_part(recording, live, tmp_path,
                                                                  monkeypatch):
    found = answer(recording, load(SERVO))
    bag = tmp_path / 'bag'
    write_predictions(bag, found, recording) if live else write_recording(bag, recording)
    monkeypatch.setattr(parts, 'SAMPLES', 300)
    played = PlayedBag(bag)
    wanted = np.array([*(recording[name] for name in CHANNELS),
                       *(found.prediction[name] for name in PREDICTED),
                       *(found.residual[name] for name in COMPARED + BALANCES)], np.float32)
    np.testing.assert_array_equal(played._rows.part(0, len(recording)), wanted)
    np.testing.assert_array_equal(played._rows.part(777, 1300), wanted[:, 777:1300])
    played.play(False, 1.5)
    last = played.recording(0.5)
    np.testing.assert_array_equal(last['load_position'], recording['load_position'][1000:1500])
    played.close()


def test_it_holds_no_more_of_a_longer_bag(recording, tmp_path, monkeypatch):
    monkeypatch.setattr(parts, 'SAMPLES', 500)
    peaks = []
    for count in (2, 12):
        bag = tmp_path / f'bag{count}'
        with RecordingWriter(bag, 10) as written:
            for k in range(count):
                written.add(replace(recording, start=2.0 * k, sequence=len(recording) * k))
        tracemalloc.start()
        PlayedBag(bag).close()
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]  # held whole, it would be six times as much
