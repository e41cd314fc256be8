"""
The result: models on the emulated bench as in paper 000, learners, and real machines.

Writes a page and its pictures. Recordings of the bench are made once and kept in the folder WORK,
with the figures of each part: a part that is left out keeps those of the last time. DATA holds
the folders emps, xl330 and two_mass as their authors published them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from importlib import import_module
import json
from pathlib import Path
import time

from .page import page

MACHINES = ('emps', 'xl330', 'two_mass')
PARTS = ('bench', 'learners', *MACHINES)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('data', type=Path, nargs='?', metavar='DATA',
                        help='folder of the published recordings; left out, these are left out')
    parser.add_argument('-o', '--output', type=Path, default=Path('docs/results.md'),
                        metavar='PAGE.md', help='default %(default)s; pictures go to pictures/ '
                        'beside it')
    parser.add_argument('--work', type=Path, default=Path('results'),
                        help='folder of recordings and figures (default %(default)s)')
    parser.add_argument('--parts', nargs='+', choices=PARTS, help='default: all that can be made')
    parser.add_argument('--seconds', type=float, default=60.0,
                        help='at most, for each learner (default %(default)g)')


def main(arguments: argparse.Namespace) -> int:
    """Make the parts and write the page."""
    wanted = tuple(arguments.parts or PARTS)
    machines = [part for part in wanted if part in MACHINES]
    if arguments.data is None:
        if arguments.parts and machines:
            raise ValueError(f'{machines[0]} needs the folder DATA of the published recordings')
        wanted = tuple(part for part in wanted if part not in MACHINES)
    else:
        for machine in machines:
            if not (arguments.data / machine).is_dir():
                raise ValueError(f'{arguments.data / machine}: there is no such folder of '
                                 'recordings')
    if not arguments.output.parent.is_dir():
        raise ValueError(f'{arguments.output}: there is no folder {arguments.output.parent}')
    pictured = arguments.output.parent / 'pictures'
    for folder in (arguments.work, pictured):
        folder.mkdir(parents=True, exist_ok=True)
    for part in wanted:
        begun = time.perf_counter()
        with _bar(part) as told:
            found = _made(part, arguments, pictured, told)
        found['seconds'] = time.perf_counter() - begun
        _kept(arguments.work, part).write_text(json.dumps(found, indent=1) + '\n')
        print(f'{part}: {found["seconds"]:.0f} s', flush=True)
    known = {part: json.loads(_kept(arguments.work, part).read_text())
             for part in PARTS if _kept(arguments.work, part).exists()}
    arguments.output.write_text(page(known))
    print(f'written to {arguments.output}')
    return 0


def _made(part: str, arguments: argparse.Namespace, pictured: Path,
          told: Callable[[str, float], None]) -> dict:
    if part == 'bench':
        from .bench import bench
        return bench(arguments.work, pictured, told)
    if part == 'learners':
        from .learners import learners
        return learners(arguments.work, pictured, arguments.seconds, told)
    told(part, 0.0)
    return import_module(f'..real.{part}', __package__).figures(arguments.data)


def _kept(work: Path, part: str) -> Path:
    return work / f'{part}.json'


def _bar(part: str):
    from contextlib import contextmanager

    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    @contextmanager
    def shown():
        console = Console(stderr=True)
        with Progress(TextColumn('{task.description}'), BarColumn(), TimeElapsedColumn(),
                      console=console, transient=True, disable=not console.is_terminal) as bar:
            task = bar.add_task(part, total=1.0)
            yield lambda said, share: bar.update(task, description=f'{part}: {said}',
                                                 completed=share)

    return shown()
