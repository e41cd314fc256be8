"""
Finds where the machine breaks: rates, bags, rigs side by side, servo files.

    python tests/benchmarks/bench_limits.py [--only rate rigs bag servo] [--seconds S]

Each limit is the last step that held and what was said one step beyond. A step of `rate` and of
`rigs` is a run of `servo-twin run`. It holds when no sample is lost and the twin never began
again. A bag is one of the bench, recorded headless. Each command that takes bags runs over it in a
process of its own.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
import json
from pathlib import Path
import random
import re
import subprocess
import sys
from tempfile import TemporaryDirectory
import time

import numpy as np

from servo_twin.bag import RecordingWriter
from servo_twin.description.servo_file import dumps, load
from servo_twin.description.shipped import shipped
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS
from servo_twin.recording.recording import COLUMNS, COMPARED, PREDICTED, Recording

PEAK = """
import atexit, re, runpy, sys, time
atexit.register(lambda: print(
    re.search('VmHWM: *([0-9]+)', open('/proc/self/status').read().replace(chr(9), ' '))[1],
    time.process_time()))
sys.argv = sys.argv[1:]
runpy.run_module(sys.argv[0], run_name='__main__')
"""
"""Runs a module, and prints the KiB that it held at most and its s of processor."""

LENGTHS = (5, 20, 60)
"""Minutes of the bags whose memory is measured; the slope is between the last two."""


def main() -> int:
    """Print the limits that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--only', nargs='*', default=['rate', 'rigs', 'bag', 'servo'])
    parser.add_argument('--seconds', type=float, default=8.0, help='of each run')
    parser.add_argument('--child', help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        return _child(arguments.child)
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
    """Print what each command holds at most while it goes through bags of these lengths."""
    rows: dict[str, list[float]] = {}
    for minutes in LENGTHS:
        with TemporaryDirectory(prefix='servo_limits_') as folder:
            bag, table, log = (Path(folder) / name for name in ('bag', 'table.csv', 'log.mcap'))
            _recorded(bag, table, log, minutes)
            size = sum(file.stat().st_size for file in bag.iterdir())
            print(f'bag of {minutes} min at 1 kHz, {size / 2**20:.0f} MiB on disk:', flush=True)
            for name, words in _commands(bag, table, log, Path(folder)).items():
                peak, took, said = _peak_of(words)
                rows.setdefault(name, []).append(peak)
                print(f'  {name:15} {peak:6.0f} MiB at most, {took:6.1f} s of processor{said}',
                      flush=True)
    hours = (LENGTHS[-1] - LENGTHS[-2]) / 60.0
    heads = ' | '.join(f'{minutes} min' for minutes in LENGTHS)
    print(f'| most memory held, MiB | {heads} | more for each hour |')
    print('|---' * (len(LENGTHS) + 2) + '|')
    for name, peaks in rows.items():
        print(f'| `{name}` | {" | ".join(f"{peak:.0f}" for peak in peaks)} | '
              f'{(peaks[-1] - peaks[-2]) / hours:.0f} |', flush=True)


def _commands(bag: Path, table: Path, log: Path, folder: Path) -> dict[str, list[str]]:
    return {
        'replay': ['servo_twin.cli', 'replay', bag, '-o', folder / 'replayed', '--page',
                   folder / 'page.html'],
        'info': ['servo_identify.cli', 'info', bag],
        'check': ['servo_identify.cli', 'check', bag, '--servo', 'rv_bench'],
        'diagnose': ['servo_identify.cli', 'diagnose', bag, '--servo', 'rv_bench', '-o',
                     folder / 'diagnosis'],
        'import': ['servo_identify.cli', 'import', table, '--servo', 'rv_bench', '-o',
                   folder / 'imported'],
        'import messages': ['servo_identify.cli', 'import', log, '--servo', 'rv_bench',
                            '--mapping', log.with_suffix('.yaml'), '-o', folder / 'messages'],
    }


def _recorded(bag: Path, table: Path, log: Path, minutes: int) -> None:
    """Record the bench's servo file, headless and as fast as it goes, a minute at a time."""
    servo = load(shipped('servos/rv_bench.yaml'))
    state, chance = initial_state(servo), np.random.default_rng(1)
    with (RecordingWriter(bag, 10) as written, table.open('w', encoding='utf8') as rows,
          _log(log) as say):
        rows.write('t,motor_position,load_position,torque,current,voltage\n')
        for minute in range(minutes):
            time = 60.0 * minute + np.arange(60_000) * 1e-3
            columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
            columns['reference_velocity'] = 0.3 * np.sin(1.6 * time) + 0.15 * np.sin(4.9 * time)
            y = simulate(servo, inputs_of(columns), 1e-3, state, 'closed_loop')
            columns.update(zip(PREDICTED, y.T.copy(), strict=True))
            for name in COMPARED:
                columns[name] += servo.noise(name) * chance.standard_normal(len(time))
            written.add(Recording('bench', 1e-3, columns, start=60.0 * minute, servo=servo.name,
                                  servo_file=dumps(servo), sequence=60_000 * minute))
            np.savetxt(rows, np.column_stack([time, *(columns[name] for name in (
                *COMPARED, 'voltage'))]), fmt='%.9g', delimiter=',')
            for k in range(0, len(time), 2):
                say(time[k], {name: float(columns[name][k]) for name in (*COMPARED, 'voltage')})


@contextmanager
def _log(path: Path) -> Iterator[Callable[[float, dict[str, float]], None]]:
    """Give what logs numbers of a time, s, as JSON, with the jitter of a busy controller."""
    from mcap.writer import Writer

    late = random.Random(1)
    path.with_suffix('.yaml').write_text('time: {source: /joint.stamp}\ncolumns:\n' + ''.join(
        f'  {name}: {{source: /joint.{name}}}\n' for name in (*COMPARED, 'voltage')))
    with path.open('wb') as stream:
        writer = Writer(stream)
        writer.start()
        joint = writer.register_channel(
            '/joint', 'json', writer.register_schema('Joint', 'jsonschema', b'{}'))

        def say(time: float, numbers: dict[str, float]) -> None:
            ns = round((time + late.uniform(0.0, 2e-4)) * 1e9)
            stamp = {'sec': ns // 10**9, 'nanosec': ns % 10**9}
            writer.add_message(joint, ns, json.dumps({'stamp': stamp, **numbers}).encode(), ns)

        yield say
        writer.finish()


def _peak_of(words: list[str | Path]) -> tuple[float, float, str]:
    """Run a command; return the MiB that it held at most, s of processor, and how it failed."""
    done = subprocess.run([sys.executable, '-c', PEAK, *map(str, words)], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    *lines, told = done.stdout.strip().splitlines()
    peak, took = map(float, told.split())
    return (peak / 1024.0, took,
            f'; it ended with {done.returncode}: {lines[-1]}' if done.returncode else '')


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
            told = subprocess.run([sys.executable, __file__, '--child', str(path)],
                                  capture_output=True, text=True, check=False)
        said = (told.stdout or told.stderr).strip()
        print(f'servo file of {count:4} effects: {said}', flush=True)


def _child(path: str) -> int:
    """Read a servo file in a process of its own and say what it took."""
    begin = time.process_time()
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
