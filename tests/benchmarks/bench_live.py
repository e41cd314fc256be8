"""
The whole chain live: rig, hub, driver, twin and recorder as processes, at 1 and at 4 kHz.

    python tests/benchmarks/bench_live.py [SECONDS]

What is lost is counted in the bag. Latencies are from the instant of a message's last sample to
the recorder having its answer; a residual comes half a filter window (20 ms) late by design, which
is in the figure. The reference, over two hops without bus and rig: median / 99 % of 0.5 / 2.1 ms
with one sample a message, 1.3 / 3.0 ms with ten.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import sys
from tempfile import TemporaryDirectory

import numpy as np
from rosbags.highlevel import AnyReader

from servo_twin.bag import read_predictions, read_recording
from servo_twin.bringup import Bench, record
from servo_twin.shipped import servo_at, shipped


def main() -> int:
    """Print a block of lines for each rate; 1 when a sample was lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('seconds', type=float, nargs='?', default=60.0)
    seconds = parser.parse_args().seconds
    lost = 0
    for rate, block in ((1000.0, 1), (1000.0, 10), (4000.0, 40)):
        with TemporaryDirectory() as folder:
            lost += _run(Path(folder) / 'live', seconds, rate, block)
    return int(lost > 0)


def _run(folder: Path, seconds: float, rate: float, block: int) -> int:
    bench = Bench(folder=folder, servo=servo_at('rv_bench'), driver=shipped('driver.yaml'),
                  rig=shipped('rigs/rv_bench.yaml'), turned=(), namespace='rig',
                  mode='measured_input', rate=rate, block=block, family='sine',
                  command='velocity', settings=('amplitude=0.5', 'frequency=0.25'),
                  duration=seconds)
    outcome = record(bench)
    recording, answer = read_recording(bench.bag), read_predictions(bench.bag)
    lost = int(np.isnan(recording['voltage']).sum())
    unanswered = len(recording) - int(np.isfinite(answer.prediction['voltage']).sum())
    print(f'{rate:g} Hz, {block} samples a message, {recording.duration:.1f} s on '
          f'{os.cpu_count()} cores: {len(recording)} samples recorded, {lost} lost, '
          f'{unanswered} unanswered')
    print('  of a core: ' + ', '.join(f'{n} {share:.0%}' for n, share in outcome.cpu.items()))
    for topic, late in _latencies(bench.bag, 1.0 / rate).items():
        middle, high, most = np.percentile(late, (50, 99, 100)) * 1e3
        print(f'  {topic:20} median {middle:6.2f} ms   99 % {high:6.2f} ms   most {most:6.1f} ms')
    return lost + unanswered


def _latencies(bag: Path, period: float) -> dict[str, np.ndarray]:
    late: dict[str, list[float]] = {}
    with AnyReader([bag]) as reader:
        wanted = [c for c in reader.connections
                  if c.topic.endswith(('/encoder', '/prediction', '/residual'))]
        for connection, arrived, data in reader.messages(wanted):
            message = reader.deserialize(data, connection.msgtype)
            values = message.motor_position
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            taken = stamp * 1e-9 + (len(values) - 1) * period
            late.setdefault(connection.topic, []).append(arrived * 1e-9 - taken)
    return {topic: np.array(values) for topic, values in late.items()}


if __name__ == '__main__':
    sys.exit(main())
