"""
The start of every command beside that of Python alone: time, processor time and memory.

Then the replay of a recording of 30 s, from the call to the page.

Run with `python`; the aim is 0.2 s for `--help` on an idle machine. ARGS: commands to try instead.
"""

import os
from pathlib import Path
import subprocess
import sys
import tempfile
from time import perf_counter

from speed_table import row

from servo_identify.cli import COMMANDS as OF_IDENTIFY
from servo_twin.cli import added_commands
from servo_twin.cli import COMMANDS as OF_TWIN

ROUNDS = 5
GOAL, REPLAYED = 0.2, 1.0  # s of `--help`; s of a short replay


def measured(*words: str) -> tuple[float, float, float]:
    """Return the least wall time (s), processor time (s) and largest memory (MB) of a command."""
    found = []
    for _ in range(ROUNDS):
        begun = perf_counter()
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise SystemExit(f'{" ".join(words)} ended with {process.returncode}')
        found.append((perf_counter() - begun, used.ru_utime + used.ru_stime,
                      used.ru_maxrss / 1024.0))
    return tuple(map(min, zip(*found, strict=True)))


def replayed(seconds: float) -> tuple[float, float, float]:
    """Return the same of a replay of so many seconds."""
    from bench_replay import driven

    from servo_twin.bag import write_recording
    from servo_twin.description import servo_file
    from servo_twin.description.shipped import servo_at
    servo = servo_file.load(servo_at('rv_bench'))
    with tempfile.TemporaryDirectory() as folder:
        bag = write_recording(Path(folder) / 'bag', driven(servo, seconds))
        return measured('servo-twin', 'replay', str(bag), '--servo', 'rv_bench', '-o',
                        f'{folder}/answer', '--force')


def main() -> None:
    """Print the table, one command a line."""
    commands = [('servo-twin', name) for name in OF_TWIN] + [
        ('servo-identify', name)
        for name in (*OF_IDENTIFY, *added_commands('servo_identify.commands'))]
    several = [one.split() for one in sys.argv[1:]] or [
        [sys.executable, '-c', 'pass'], ['servo-twin', '--help'], ['servo-identify', '--help'],
        *([*one, '--help'] for one in commands)]
    print(f'{"command":<44}{"wall, s":>9}{"processor, s":>14}{"memory, MB":>12}')
    found = {}
    for words in several:
        wall, processor, memory = found[tuple(words)] = measured(*words)
        said = ' '.join(word if word != sys.executable else 'python' for word in words)
        print(f'{said:<44}{wall:>9.2f}{processor:>14.2f}{memory:>12.0f}', flush=True)
    if sys.argv[1:]:
        return
    python, *others = found.values()
    slowest, _, largest = map(max, zip(*others, strict=True))
    row(f'`--help` of {len(others)} commands', f'at most {slowest:.2f} s, {largest:.0f} MB',
        f'goal {GOAL} s; Python alone {python[0]:.2f} s, {python[2]:.0f} MB', GOAL / slowest)
    wall, _, memory = replayed(30.0)
    row('`servo-twin replay` of 30 s at 1 kHz, compiled before',
        f'{wall:.2f} s, {memory:.0f} MB', f'goal {REPLAYED:g} s', REPLAYED / wall)


if __name__ == '__main__':
    main()
