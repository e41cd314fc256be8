"""
Runs the benchmarks and puts their figures into one table, each beside its reference.

    python tests/benchmarks/speed_table.py [NAME...] [--page docs/speed.md]

NAME is that of a file without `bench_`; left out, all. A benchmark prints its rows by `row`. The
rows of those that ran replace the ones on the page; the others stay.
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

`make bench` runs each figure and its reference, and writes this table. To run some and replace
their rows alone, name them: `make bench ARGS="step fit"`. Ratio is how many times better than the
reference a figure is: below 1 a goal is missed. The last column has the load of the machine before
the run; the last run was on {machine}.

| what | seen | reference | ratio | command |
|---|---|---|---|---|
{rows}

`bench_chain.py --driver all --block 5 --seconds 20` runs every protocol and the adapter, and
prints each beside CANopen at 1 kHz. Beside a load of 6 to 9 from elsewhere the median from sample
to prediction was 0.72 times that of CANopen for RobStride, 0.75 for CubeMars, 0.74 for moteus and
1.19 for the adapter. RobStride lost none of 10665 samples, CANopen 2, CubeMars 34 and moteus 295
(4509 in another run); the adapter left 760 out, whose robot was held up. ODrive lost 2897 of 9712
at a load of 9, and what came was 1.05 s late; alone at a load of 7.5 it lost none of 7950.

Commands lie in `tests/benchmarks`. Under load the figures are others: replay with ten effects was
seen at 1217 to 1242 times real time at a load of 6 to 11. The chain at 1 kHz with one sample a
message then lost samples; with ten a message, the default of `servo-twin run`, it did not.

On two idle cores `bench_machines.py --starts` compiled a new machine in 2.4 to 4.9 s (goal 5 s),
and started one that was compiled before in 0.24 to 0.29 s. A step of each machine took 0.5 to 1.95
times that of two inertias with Coulomb and viscous friction (goal 2). With brake, run-out and
cogging at work the EMA bench took 2.6 times.

`bench_machines.py`, `bench_against.py`, `bench_limits.py` and `bench_adapter.py` measure more; the
first lines of each say what.
"""


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


def replaced(page: Path, rows: list[str], names: tuple[str, ...]) -> list[str]:
    """Return the rows of a page with those of the named benchmarks replaced, in their order."""
    lines = page.read_text('utf8').splitlines() if page.exists() else []
    kept = [line for line in lines if line.startswith(MARK) and '`bench_' in line]
    every = [*(line for line in kept if _bench_of(line) not in names), *rows]
    return sorted(every, key=lambda line: BENCHES.index(_bench_of(line)))


def _bench_of(line: str) -> str:
    return line.rpartition('`bench_')[2].partition('.py')[0].partition(' ')[0]


def main() -> None:
    """Print the table, and write the page if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('names', nargs='*', metavar='NAME', default=BENCHES)
    parser.add_argument('--page', type=Path)
    asked = parser.parse_args()
    on = machine()
    rows = [one for name in asked.names for one in rows_of(name)]
    print(f'\n{on}\n| what | seen | reference | ratio | command |\n|---|---|---|---|---|')
    print('\n'.join(rows))
    if asked.page:
        asked.page.write_text(PAGE.format(
            machine=on, rows='\n'.join(replaced(asked.page, rows, tuple(asked.names)))), 'utf8')


if __name__ == '__main__':
    main()
