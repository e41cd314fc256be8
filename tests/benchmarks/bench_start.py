"""
The start of every command beside that of Python alone: time, processor time and memory.

Run with `python`; the aim is 0.2 s for `--help` on an idle machine. ARGS: commands to try instead.
"""

import os
import subprocess
import sys
from time import perf_counter

from servo_identify.cli import COMMANDS as OF_IDENTIFY
from servo_twin.cli import added_commands
from servo_twin.cli import COMMANDS as OF_TWIN

ROUNDS = 5


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


def main() -> None:
    """Print the table, one command a line."""
    commands = [('servo-twin', name) for name in OF_TWIN] + [
        ('servo-identify', name)
        for name in (*OF_IDENTIFY, *added_commands('servo_identify.commands'))]
    several = [one.split() for one in sys.argv[1:]] or [
        [sys.executable, '-c', 'pass'], ['servo-twin', '--help'], ['servo-identify', '--help'],
        *([*one, '--help'] for one in commands)]
    print(f'{"command":<44}{"wall, s":>9}{"processor, s":>14}{"memory, MB":>12}')
    for words in several:
        wall, processor, memory = measured(*words)
        said = ' '.join(word if word != sys.executable else 'python' for word in words)
        print(f'{said:<44}{wall:>9.2f}{processor:>14.2f}{memory:>12.0f}', flush=True)


if __name__ == '__main__':
    main()
