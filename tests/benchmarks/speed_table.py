"""
Runs the benchmarks and puts their figures into one table, each beside its reference.

    python tests/benchmarks/speed_table.py [NAME...] [--page docs/speed.md]

NAME is that of a file without `bench_`; left out, all. A benchmark prints its rows by `row`. The
page is written where all of them ran.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import platform
import subprocess
import sys

HERE = Path(__file__).resolve().parent
BENCHES = ('start', 'step', 'bag', 'replay', 'fit', 'diagnose', 'libraries', 'chain', 'setup')
MARK = '| '
PAGE = """# How fast

`make bench` runs each figure and its reference, and prints this table. This one was made on
{machine}. Goals are ours; a figure that misses its goal is a defect.

| what | seen | reference | command |
|---|---|---|---|
{rows}

Commands lie in `tests/benchmarks`. Under load the figures are others: replay with ten effects was
seen at 1217 to 1242 times real time at a load of 6 to 11. The chain at 1 kHz with one sample a
message then lost samples; with ten a message, the default of `servo-twin run`, it did not.

`bench_machines.py`, `bench_against.py`, `bench_limits.py` and `bench_adapter.py` measure more; the
first lines of each say what.
"""


def row(what: str, seen: str, reference: str) -> None:
    """Print one row of the table."""
    print(f'{MARK}{what} | {seen} | {reference} |', flush=True)


def rows_of(name: str) -> list[str]:
    """Run a benchmark, pass on what it prints, and return its rows; raises SystemExit."""
    print(f'== bench_{name}.py', flush=True)
    found = []
    with subprocess.Popen([sys.executable, HERE / f'bench_{name}.py'], text=True,
                          stdout=subprocess.PIPE) as bench:
        for line in bench.stdout:
            if line.startswith(MARK):
                found.append(f'{line.strip()} `bench_{name}.py` |')
            else:
                print(line, end='', flush=True)
    if not found:
        raise SystemExit(f'bench_{name}.py ended with {bench.returncode} and no figure')
    return found


def machine() -> str:
    """Return in words what the figures were measured on."""
    load = os.getloadavg()[0]
    return (f'{len(os.sched_getaffinity(0))} cores ({platform.machine()}) at a load of {load:.1f} '
            f'before, with Python {platform.python_version()}')


def main() -> None:
    """Print the table, and write the page if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('names', nargs='*', metavar='NAME', default=BENCHES)
    parser.add_argument('--page', type=Path)
    asked = parser.parse_args()
    on = machine()
    rows = [one for name in asked.names for one in rows_of(name)]
    print(f'\n{on}\n| what | seen | reference | command |\n|---|---|---|---|')
    print('\n'.join(rows))
    if asked.page:
        asked.page.write_text(PAGE.format(machine=on, rows='\n'.join(rows)))


if __name__ == '__main__':
    main()
