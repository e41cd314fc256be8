"""
How many times faster than real time a bag is replayed, on one core.

    python tests/benchmarks/bench_replay.py [SECONDS]

The bench of paper 000 with the effects of bench_step, sampled at 1 kHz and stepped at 0.1 ms.
Reading the bag, predictions, residuals of all balances and writing them all count, in processor
time of the best of five runs. The reference is real time; the goals are 1000 without and 300 with
a network.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import sys
from tempfile import TemporaryDirectory
from time import process_time

from bench_step import CASES as STEPPED
from bench_step import servo_with
import numpy as np
from speed_table import row

from servo_twin.bag import open_recording, RecordingWriter, write_recording
from servo_twin.lockstep.lockstep import warm_up
from servo_twin.lockstep.whole_recording import Answering
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, PREDICTED, Recording

CASES = {'Coulomb and viscous friction': None, 'ten effects': 1000.0,
         'ten effects, one a 2-30-1 network': 300.0}
"""Servos of bench_step, and how many times real time their replay shall be."""


def driven(servo: Servo, seconds: float, period: float = 1e-3) -> Recording:
    """Return what the servo itself records while its speed follows two sines."""
    time = np.arange(round(seconds / period)) * period
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['reference_velocity'] = 0.3 * np.sin(1.6 * time) + 0.15 * np.sin(4.9 * time)
    y = simulate(servo, inputs_of(columns), period, initial_state(servo), 'closed_loop')
    columns.update(zip(PREDICTED, y.T, strict=True))
    return Recording('bench', period, columns, family='sine')


def main() -> int:
    """Print a line for each servo and number of samples a message; 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('seconds', type=float, nargs='?', default=600.0)
    seconds = parser.parse_args().seconds
    core = min(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {core})
    print(f'{seconds:g} s of recording, 1 kHz, step 0.1 ms, core {core} alone')
    print(f'{"servo":36}{"block":>6}{"took s":>9}{"x real time":>13}{"goal":>7}')
    missed = 0
    for label, goal in CASES.items():
        servo = servo_with(STEPPED[label][0])
        recording = driven(servo, seconds)
        warm_up(servo)
        for block in (1, 100):
            with TemporaryDirectory() as folder:
                bag = write_recording(Path(folder) / 'bag', recording, block)
                took = min(_once(bag, servo, Path(folder) / f'out{k}') for k in range(5))
            ratio = seconds / took
            missed += goal is not None and ratio < goal
            print(f'{label:36}{block:6}{took:9.3f}{ratio:13.0f}'
                  f'{"" if goal is None else f"{goal:.0f}":>7}')
            row(f'replay of a bag, {label}, {block} a message', f'{ratio:.0f} times real time',
                '' if goal is None else f'goal {goal:.0f}', None if goal is None else ratio / goal)
    return int(missed > 0)


def _once(bag: Path, servo: Servo, out: Path) -> float:
    begin = process_time()
    with open_recording(bag) as recording, RecordingWriter(out) as written:
        for part, answer in Answering(recording, servo):
            written.add(part, answer)
    return process_time() - begin


if __name__ == '__main__':
    sys.exit(main())
