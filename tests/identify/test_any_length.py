"""Bags of any length in Python and for play: what a process holds does not grow with them."""

from dataclasses import dataclass
from math import pi
from pathlib import Path
import re
import subprocess
import sys

import numpy as np
import pytest

from servo_identify.api import calls
from servo_identify.api.calls import read
from servo_identify.data import long_bags
from servo_identify.data.long_bags import LONGEST
from servo_identify.data.reading import open_one, read_one
from servo_identify.diagnose import diagnose as module
from servo_identify.learn.transmission.two_way_backlash import measured_play
from servo_twin.bag import BagError, RecordingWriter
from servo_twin.description.servo_file import load
from servo_twin.recording import parts
from servo_twin.recording.recording import Recording

SERVO = Path(__file__).resolve().parents[2] / 'config' / 'servos' / 'ema_bench.yaml'
RATIO, PERIOD, WIDTH = 124.0, 1e-3, 2e-3
SWEEP = 20_000  # samples of one way forth and back
LENGTHS = (20, 80)  # sweeps: both longer than what is held at once
WHOLE = 8 * 13 * SWEEP * (LENGTHS[1] - LENGTHS[0])  # bytes by which all columns would grow

ASKS = {
    'play': "main(['play', bag, '--servo', servo, '--quiet'])",
    'read': "data = si.read(bag, servo); print(data); data[0]['load_position'].sum()",
}
SCRIPT = """
import sys
from threading import Event, Thread
from servo_identify.cli import main
import servo_identify as si
bag, servo = sys.argv[1:]
held, over = [0], Event()
def watch():
    while not over.wait(0.003):
        with open('/proc/self/status') as told:
            held.append(next(int(line.split()[1]) for line in told if 'RssAnon' in line))
watching = Thread(target=watch)
watching.start()
{asks}
over.set()
watching.join()
print('most', 1024 * max(held))
"""
"""Prints the bytes that were held at most: those of pages that no file has."""


def swept(path, sweeps):
    """Write a bag whose load goes forth and back so often, behind a gap; the motor leads."""
    t = np.arange(SWEEP) * PERIOD
    load = 0.4 * np.sin(2.0 * pi * t / (SWEEP * PERIOD))
    way = np.cos(2.0 * pi * t / (SWEEP * PERIOD))
    motor = RATIO * (load + 0.5 * WIDTH * np.clip(50.0 * way, -1.0, 1.0))
    with RecordingWriter(path, 50) as bag:
        for k in range(sweeps):
            noise = 1e-5 * np.random.default_rng(k).standard_normal(SWEEP)
            bag.add(Recording(path.name, PERIOD, {
                'motor_position': motor, 'load_position': load + noise, 'current': way,
                'voltage': 10.0 * way}, start=100.0 + SWEEP * PERIOD * k, sequence=SWEEP * k))
    return path


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp('bags')
    return [swept(folder / f'bag{count}', count) for count in LENGTHS]


@pytest.mark.long
@pytest.mark.skipif(sys.platform != 'linux', reason='the memory of a process is read from /proc')
@pytest.mark.parametrize('what', ASKS)
def test_a_process_holds_no_more_of_a_longer_bag(bags, what):
    peaks = []
    for bag in bags:
        done = subprocess.run([sys.executable, '-c', SCRIPT.format(asks=ASKS[what]), str(bag),
                               str(SERVO)], capture_output=True, text=True, check=True)
        peaks.append(int(re.search(r'most (\d+)', done.stdout)[1]))
    assert SWEEP * LENGTHS[0] > LONGEST
    assert peaks[1] - peaks[0] < 0.25 * WHOLE


def test_play_in_parts_is_that_of_the_whole(bags, monkeypatch):
    servo, whole = load(SERVO), read_one(bags[0])
    with open_one(bags[0]) as opened:
        found = measured_play(servo, opened)
    monkeypatch.setattr(parts, 'SAMPLES', 10**9)
    expected = measured_play(servo, whole)
    assert found.width == pytest.approx(expected.width, rel=1e-9)
    assert found.std == pytest.approx(expected.std, rel=1e-6)
    np.testing.assert_allclose(found.widths, expected.widths, rtol=1e-9)
    assert found.width + found.wound == pytest.approx(WIDTH, rel=0.02)


def test_arrays_on_disk_are_those_in_memory(bags):
    data, whole = read(bags[0], SERVO), read_one(bags[0])
    one, = data
    assert (one.name, one.digest, one.warnings, one.start, one.sequence) == (
        whole.name, whole.digest, whole.warnings, whole.start, whole.sequence)
    for name, column in whole.columns.items():
        np.testing.assert_array_equal(one[name], column)


@dataclass(frozen=True)
class Nothing:
    """What a fit that is left out returns."""

    warnings: tuple[str, ...] = ()


def test_of_a_long_recording_the_same_parts_are_fitted_and_diagnosed(bags, monkeypatch):
    data, taken = read(bags[0], SERVO), []

    def diagnosed(several, servo, accept, report, without, **how):
        taken.extend((several, accept))

    monkeypatch.setattr(module, 'diagnose', diagnosed)
    monkeypatch.setattr(calls, 'Answer', lambda found, machine: None)
    monkeypatch.setattr(calls, 'Fitted', lambda found, machine: None)

    def fitted(servo, several, names, **how):
        taken.append(several)
        return Nothing()

    monkeypatch.setattr(calls, 'fit_output_error', fitted)
    calls.diagnose(data, SERVO, accept=data)
    calls.fit(data, SERVO, ['effects.encoder_coulomb.level'], despite_check=True)
    parts = [(one.sequence, len(one)) for one in taken[0]]
    assert len(parts) == long_bags.CHOSEN and taken[1] == taken[0]
    assert [(one.sequence, len(one)) for one in taken[2]] == parts


def test_a_disk_without_room_is_named_with_what_to_do(bags, monkeypatch):
    monkeypatch.setattr(long_bags.shutil, 'disk_usage', lambda folder: type('U', (), {'free': 9}))
    with pytest.raises(BagError, match='bag20: .* GiB are free; let TMPDIR name'):
        read(bags[0], SERVO)
