"""
The time of one step and of the first start of every machine, beside the two-inertia servo.

    python tests/benchmarks/bench_machines.py [SERVO ...] [--starts]

For each servo file in `config/servos`, or those named: processor time a step, the best of many
short runs of 20 steps a sample, and how much that is of the two inertias with Coulomb and viscous
friction (`config/servos/rv_plain.yaml`), and of the same with the ten effects of bench_step.py;
goal: at most twice. An effect whose amplitudes are zero in the file costs nothing; "all at work"
is the machine with amplitudes for these too. With --starts each is also compiled by a new process
into an empty cache, and started by another one that finds it there: goals 5 s, next to nothing.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time

from bench_step import NINE, servo_with
import numpy as np

from servo_twin.description import servo_file
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS

SERVOS = Path(__file__).parents[2] / 'config' / 'servos'
REFERENCE = 'rv_plain'
STEPS, SAMPLES, RUNS = 20, 500, 40
"""Steps a sample, the same for all: sensors and controllers cost once a sample."""

START = """
import sys, time
from servo_twin import servo_file
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS
import numpy as np
servo = servo_file.load(sys.argv[1])
begun = time.perf_counter()
u = inputs_of({name: np.zeros(2) for name in INPUTS})
simulate(servo, u, 1e-3, initial_state(servo, 0.0, 0.0))
print(time.perf_counter() - begun)
"""


def step_of(servo: Servo) -> float:
    """Return the least processor time of a step, ns, while the servo is driven to and fro."""
    columns = {name: np.full(SAMPLES, np.nan) for name in INPUTS}
    period = STEPS * servo.step
    columns['voltage'] = 2.0 * np.sin(8.0 * np.pi * period * np.arange(SAMPLES))
    u, x = inputs_of(columns), initial_state(servo, 0.0, 0.0)
    simulate(servo, u, period, x.copy())
    taken = []
    for _ in range(RUNS):
        copy, begun = x.copy(), time.thread_time()
        simulate(servo, u, period, copy)
        taken.append(time.thread_time() - begun)
    return 1e9 * min(taken) / (SAMPLES * STEPS)


def at_work(servo: Servo) -> Servo:
    """Return the servo with an amplitude for every effect that has none."""
    values = {}
    for placed in servo.effects:
        for name in placed.effect.amplitudes():
            parameter = placed.effect.parameters[name]
            path = f'effects.{placed.name}.{name}'
            if not np.any(np.asarray(servo.values[path]) != parameter.off):
                small = parameter.off + 1e-4
                values[path] = (small,) * np.size(servo.values[path]) if parameter.row else small
    return servo.with_values(values)


def starts_of(path: Path) -> tuple[float, float]:
    """Return seconds until the first sample, with an empty cache and with a filled one."""
    with tempfile.TemporaryDirectory() as cache:
        seconds = [float(subprocess.run(
            [sys.executable, '-c', START, str(path)], check=True, capture_output=True, text=True,
            env={**os.environ, 'SERVO_TWIN_CACHE': cache}).stdout) for _ in range(2)]
    return seconds[0], seconds[1]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('servos', nargs='*', default=sorted(p.stem for p in SERVOS.glob('*.yaml')))
    parser.add_argument('--starts', action='store_true', help='also time compiling and starting')
    arguments = parser.parse_args()
    reference = step_of(servo_file.load(SERVOS / f'{REFERENCE}.yaml'))
    ten = step_of(servo_with((*NINE, 'gravity')))
    head = (f'{"machine":24}{"ns a step":>10}{"of " + REFERENCE:>14}{"of ten effects":>16}'
            f'{"all at work":>13}')
    print(head + (f'{"compiled, s":>13}{"started, s":>12}' if arguments.starts else ''))
    for name in arguments.servos:
        path = SERVOS / f'{name}.yaml'
        servo = servo_file.load(path)
        taken, whole = step_of(servo), step_of(at_work(servo))
        line = (f'{name:24}{taken:10.0f}{taken / reference:14.2f}{taken / ten:16.2f}'
                f'{whole / reference:13.2f}')
        if arguments.starts:
            line += '{:13.2f}{:12.2f}'.format(*starts_of(path))
        print(line, flush=True)


if __name__ == '__main__':
    main()
