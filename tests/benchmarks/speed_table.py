"""
Runs the benchmarks and puts their figures into one table, each beside its reference.

    python tests/benchmarks/speed_table.py [NAME...] [--page docs/speed.md]

NAME is that of a file without `bench_`; left out, all. A benchmark prints its rows by `row`. The
rows of those that ran replace the ones on the page; the others stay, and so does the text.
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
HEAD = '| what | seen | reference | ratio | command |\n|---|---|---|---|---|\n'


def row(what: str, seen: str, reference: str, ratio: float | None = None) -> None:
    """Print one row of the table; ``ratio``: how many times better than the reference."""
    told = '' if ratio is None else f'{ratio:.3g}'
    print(f'{MARK}{what} | {seen} | {reference} | {told} |', flush=True)


def rows_of(name: str) -> list[str]:
    """Run a benchmark, pass on what it prints, and return its rows; raises SystemExit."""
    print(f'== bench_{name}.py', flush=True)
    found, load = [], os.getloadavg()[0]
    with subprocess.Popen([sys.executable, HERE / f'bench_{name}.py'], text=True,
                          stdout=subprocess.PIPE) as bench:
        for line in bench.stdout:
            if line.startswith(MARK):
                found.append(f'{line.strip()} `bench_{name}.py`, load {load:.1f} |')
            else:
                print(line, end='', flush=True)
    if not found:
        raise SystemExit(f'bench_{name}.py ended with {bench.returncode} and no figure')
    return found


def machine() -> str:
    """Return in words what the figures were measured on."""
    return (f'{len(os.sched_getaffinity(0))} cores ({platform.machine()}) with Python '
            f'{platform.python_version()}')


def with_rows(page: str, rows: list[str], names: tuple[str, ...]) -> str:
    """Return a page with the rows of the named benchmarks replaced, in their order."""
    before, after = page.split(HEAD)
    table, _, after = after.partition('\n\n')
    kept = [line for line in table.splitlines() if _bench_of(line) not in names]
    every = sorted([*kept, *rows], key=lambda line: BENCHES.index(_bench_of(line)))
    return before + HEAD + '\n'.join(every) + '\n\n' + after


def _bench_of(line: str) -> str:
    return line.rpartition('`bench_')[2].partition('.py')[0].partition(' ')[0]


def main() -> None:
    """Print the table, and write the page if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('names', nargs='*', metavar='NAME', default=BENCHES)
    parser.add_argument('--page', type=Path)
    asked = parser.parse_args()
    rows = [one for name in asked.names for one in rows_of(name)]
    print(f'\n{machine()}\n{HEAD}' + '\n'.join(rows))
    if asked.page:
        asked.page.write_text(with_rows(asked.page.read_text('utf8'), rows, tuple(asked.names)),
                              'utf8')


if __name__ == '__main__':
    main()
