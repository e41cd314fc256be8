"""
Finds where the machine breaks: rates, bags, rigs side by side, servo files.

    python tests/benchmarks/bench_limits.py [--only rate rigs bag servo] [--seconds S]

Each limit is the last step that held and what was said one step beyond. A step of `rate` and of
`rigs` is a run of `servo-twin run`. It holds when no sample is lost and the twin never began
again.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
import re
import resource
import subprocess
import sys
from tempfile import TemporaryDirectory
import time

import numpy as np


def main() -> int:
    """Print the limits that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--only', nargs='*', default=['rate', 'rigs', 'bag', 'servo'])
    parser.add_argument('--seconds', type=float, default=8.0, help='of each run')
    parser.add_argument('--child', nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        return _child(*arguments.child)
    load = Path('/proc/loadavg').read_text().split()[0]
    print(f'load of the machine at the start: {load}')
    for name in arguments.only:
        {'rate': _rates, 'rigs': _rigs, 'bag': _bags, 'servo': _servos}[name](arguments.seconds)
    return 0


def _run(folder: Path, seconds: float, rate: float, block: int,
         namespace: str) -> tuple[bool, str]:
    """Run a bench; return whether nothing was lost, and its own line about that."""
    done = subprocess.run(
        [sys.executable, '-m', 'servo_twin.cli', 'run', '-o', str(folder / namespace), '--rate',
         str(rate), '--block', str(block), '--duration', str(seconds), '--namespace', namespace],
        capture_output=True, text=True, timeout=seconds + 180.0, check=False)
    said = re.search(r'live: (.*)', done.stdout)
    if said is None:
        return False, (done.stderr.strip().splitlines() or ['it says nothing'])[0]
    counts = {what: int(number) for number, what in
              re.findall(r'(\d+) (lost|bridged|restarts)', said[1])}
    return not any(counts.values()), said[1]


def _rates(seconds: float) -> None:
    for block in (1, 10, 100):
        held, beyond = 'none', ''
        for rate in (500, 1000, 2000, 3000, 4000, 6000, 8000, 10_000):
            with TemporaryDirectory(prefix='servo_limits_') as folder:
                well, said = _run(Path(folder), seconds, rate, block, 'rig')
            if not well:
                beyond = f'; at {rate} Hz: {said}'
                break
            held = f'{rate} Hz'
        print(f'samples a message {block:4}: {held} held{beyond}', flush=True)


def _rigs(seconds: float) -> None:
    for count in (1, 2, 3, 4, 6, 8):
        with TemporaryDirectory(prefix='servo_limits_') as folder, \
                ThreadPoolExecutor(count) as pool:
            told = list(pool.map(lambda k, folder=folder: _run(
                Path(folder), seconds, 1000, 10, f'rig{k}'), range(count)))
        bad = [said for well, said in told if not well]
        print(f'{count} rigs at 1 kHz: {"held" if not bad else "one of them: " + bad[0]}',
              flush=True)
        if bad:
            return


def _bags(seconds: float) -> None:
    from servo_twin.bag import write_recording
    from servo_twin.recording.recording import COLUMNS, Recording
    for minutes in (1, 10, 30):
        with TemporaryDirectory(prefix='servo_limits_') as folder:
            path, count = Path(folder) / 'bag', minutes * 60_000
            random = np.random.default_rng(1)
            write_recording(path, Recording('bench', 1e-3, {
                name: random.standard_normal(count) for name in COLUMNS}), 10)
            told = subprocess.run([sys.executable, __file__, '--child', 'bag', str(path)],
                                  capture_output=True, text=True, check=False)
        said = (told.stdout or told.stderr).strip()
        print(f'bag of {minutes:3} min at 1 kHz: {said}', flush=True)


def _servos(seconds: float) -> None:
    for count in (10, 30, 100, 300):
        with TemporaryDirectory(prefix='servo_limits_') as folder:
            path = Path(folder) / 'servo.yaml'
            path.write_text('servo: many\n'
                            'drive: {type: current, gain: 1.0, torque_constant: 1.0}\n'
                            'mechanism: {type: rigid, rotor_inertia: 0.1, load_inertia: 0.1, '
                            'ratio: 1.0}\neffects:\n' + ''.join(
                                f'  e{k}: {{effect: coulomb_friction, at: load, level: 0.01}}\n'
                                for k in range(count)))
            told = subprocess.run([sys.executable, __file__, '--child', 'servo', str(path)],
                                  capture_output=True, text=True, check=False)
        said = (told.stdout or told.stderr).strip()
        print(f'servo file of {count:4} effects: {said}', flush=True)


def _child(what: str, path: str) -> int:
    """Read one thing in a process of its own and say what it took."""
    from servo_twin.bag import read_recording
    from servo_twin.description.servo_file import load
    from servo_twin.physics.simulate import initial_state, simulate
    from servo_twin.physics.state import INPUTS
    before, begin = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    if what == 'bag':
        recording = read_recording(path)
        rise = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        size = sum(file.stat().st_size for file in Path(path).iterdir())
        print(f'{len(recording)} samples, {size / 2**20:.0f} MiB on disk, memory rose by '
              f'{rise / 1024:.0f} MiB, {time.process_time() - begin:.1f} s of processor')
        return 0
    servo = load(path)
    read = time.process_time()
    simulate(servo, np.zeros((1, len(INPUTS))), 1e-3, initial_state(servo))
    made = time.process_time()
    simulate(servo, np.zeros((10_000, len(INPUTS))), 1e-3, initial_state(servo))
    print(f'read in {read - begin:.2f} s, compiled in {made - read:.1f} s, '
          f'{1e9 * (time.process_time() - made) / 100_000:.0f} ns a step')
    return 0


if __name__ == '__main__':
    sys.exit(main())
