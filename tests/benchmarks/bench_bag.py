"""
A million samples written to a bag and read back, beside rosbags' decoding one by one.

    python tests/benchmarks/bench_bag.py [SAMPLES] [--live SECONDS]

Ten columns, three topics; what is read is compared bit for bit. rosbags is timed over at most
30 000 messages and scaled to all of them. ``--live`` records what a process publishes at 1 kHz,
one sample a message, and at 4 kHz in blocks of ten, and counts what is lost.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import resource
import signal
import subprocess
import sys
from tempfile import TemporaryDirectory
import time

import numpy as np
from rosbags.highlevel import AnyReader
from speed_table import row

from servo_twin.bag import read_recording, write_recording
from servo_twin.recording.recording import COLUMNS, Recording

SOURCE = Path(__file__).parents[1] / 'support' / 'sample_source.py'


def main() -> int:
    """Print one line a block size, and a run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('samples', type=int, nargs='?', default=1_000_000)
    parser.add_argument('--live', type=float, default=0.0, metavar='SECONDS')
    arguments = parser.parse_args()
    random = np.random.default_rng(1)
    original = Recording('bench', 1e-3, {
        name: random.standard_normal(arguments.samples) for name in COLUMNS})
    print(f'{arguments.samples} samples, {len(COLUMNS)} columns of noise')
    print('samples/message   write s   read s   us/message   rosbags s (us/message)   ratio')
    for size in (1, 10, 100):
        _files(original, size)
    if arguments.live:
        for rate, size in ((1000.0, 1), (4000.0, 10)):
            _live(arguments.live, rate, size)
    return 0


def _files(original: Recording, size: int) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / 'bag'
        write = _seconds(lambda: write_recording(path, original, size))
        again = read_recording(path)
        assert all(np.array_equal(again[name], original[name]) for name in COLUMNS)
        read = min(_seconds(lambda: read_recording(path)) for _ in range(3))
        messages = 3 * -(-len(original) // size)
        each = _rosbags(path)
        print(f'{size:15} {write:9.2f} {read:8.2f} {read / messages * 1e6:12.2f} '
              f'{each * messages:13.1f} ({each * 1e6:.1f}) {each * messages / read:15.0f}')
        row(f'{len(original)} samples of ten columns from a bag, {size} a message',
            f'{read:.2f} s read, {write:.2f} s written',
            f'rosbags, message by message: {each * messages:.1f} s read',
            each * messages / read)


def _rosbags(path: Path, most: int = 30_000) -> float:
    """Return seconds a message for rosbags to decode them in order."""
    with AnyReader([path]) as reader:
        begin, count = time.perf_counter(), 0
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
            count += 1
            if count == most:
                break
        return (time.perf_counter() - begin) / count


def _seconds(action) -> float:
    begin = time.perf_counter()
    action()
    return time.perf_counter() - begin


def _live(seconds: float, rate: float, size: int) -> None:
    blocks = int(seconds * rate / size)
    with TemporaryDirectory() as folder:
        path = Path(folder) / 'bag'
        recorder = subprocess.Popen(
            [sys.executable, '-m', 'servo_rig_driver.record.recorder_node', '--ros-args', '-p',
             f'output:={path}', '-p', 'topics:=[encoder, torque, current]'],
            stdout=subprocess.DEVNULL)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, SOURCE, str(blocks), str(rate), str(size)], check=True)
        source = resource.getrusage(resource.RUSAGE_CHILDREN)
        recorder.send_signal(signal.SIGINT)
        recorder.wait()
        both = resource.getrusage(resource.RUSAGE_CHILDREN)
        recording = read_recording(path)
        lost = blocks * size - int(np.isfinite(recording['voltage']).sum())
        print(f'live {rate:g} Hz, {size} samples a message, 3 topics, {seconds:g} s: {lost} of '
              f'{blocks * size} samples lost; CPU of source '
              f'{_cpu(before, source, seconds):.0f} %, recorder '
              f'{_cpu(source, both, seconds):.0f} % of a core')


def _cpu(before, after, seconds: float) -> float:
    return 100.0 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / seconds


if __name__ == '__main__':
    sys.exit(main())
