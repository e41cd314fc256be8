"""
Compare the models of the five papers on emulated and real machines, and write the pages.

Writes a page for the bench, learners and real machines, one for each machine of the other papers
(PART.md beside it), and comparison.md, the table of all systems. Recordings are made once and kept
in the folder WORK, with the figures of each part: a part that is left out keeps those of the last
time. DATA holds the folders emps, xl330 and two_mass as their authors published them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from importlib import import_module
import json
from pathlib import Path
import time
from types import ModuleType

from servo_twin.commands.terminal import judged_file, say, tell

from ..papers.paper_systems import BENCH, machines, WRITTEN

REAL = ('emps', 'xl330', 'two_mass')
RESULTS = (*BENCH, *REAL)
"""The parts of the page of results; the other parts have pages of their own."""

COMPARED = (*BENCH, *machines())
PARTS = (*RESULTS, *machines())


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('data', type=Path, nargs='?', metavar='DATA',
                        help='folder of the published recordings; left out, these are left out')
    parser.add_argument('-o', '--output', type=Path, default=Path('docs/results.md'),
                        metavar='PAGE.md', help='default %(default)s; pictures go to pictures/, '
                        'pages of machines and comparison.md beside it')
    parser.add_argument('--work', type=Path, default=Path('results'),
                        help='folder of recordings and figures (default %(default)s)')
    parser.add_argument('--parts', nargs='*', choices=PARTS, metavar='PART', help=(
                        f'of {", ".join(PARTS)}; default: all that can be made; with none, '
                        'the pages alone are written again from the figures in WORK'))
    parser.add_argument('--seconds', type=float, default=60.0,
                        help='of the processor at most, for each learner (default %(default)g)')


def main(arguments: argparse.Namespace) -> int:
    """Make the parts and write the page."""
    wanted = PARTS if arguments.parts is None else tuple(arguments.parts)
    real = [part for part in wanted if part in REAL]
    if arguments.data is None:
        if arguments.parts and real:
            raise ValueError(f'{real[0]} needs the folder DATA of the published recordings')
        wanted = tuple(part for part in wanted if part not in REAL)
    else:
        for machine in real:
            if not (arguments.data / machine).is_dir():
                raise ValueError(f'{arguments.data / machine}: there is no such folder of '
                                 'recordings')
    if not arguments.output.parent.is_dir():
        raise ValueError(f'{arguments.output}: there is no folder {arguments.output.parent}')
    for path in _pages(arguments.output, [part for part in PARTS if part in wanted
                                          or _kept(arguments.work, part).exists()]):
        judged_file(path, arguments.force)
    pictured = arguments.output.parent / 'pictures'
    for folder in (arguments.work, pictured):
        folder.mkdir(parents=True, exist_ok=True)
    for part in wanted:
        begun = time.perf_counter()
        with _bar(part) as told:
            found = _made(part, arguments, pictured, told)
        found['seconds'] = time.perf_counter() - begun
        found['made'] = date.today().isoformat()
        _kept(arguments.work, part).write_text(json.dumps(found, indent=1) + '\n')
        say(arguments, f'{part}: {found["seconds"]:.0f} s')
    known = {part: json.loads(_kept(arguments.work, part).read_text())
             for part in PARTS if _kept(arguments.work, part).exists()}
    written = _write(arguments.output, known)
    tell(arguments, parts=known, written=written)
    say(arguments, *(f'written to {path}' for path in written))
    return 0


def _write(output: Path, known: Mapping[str, dict]) -> list[Path]:
    """Write the pages of the parts that are known, and the comparison of all; return them."""
    from ..papers.paper_comparison import comparison, keep, kept
    from ..papers.results_page import made_on, page

    rows, texts = output.parent / 'comparison', {}
    for part in COMPARED:
        if part in known:
            module = of_paper(part)
            keep(rows, part, module.comparison_rows(known[part]))
            if part not in (*RESULTS, *WRITTEN):
                texts[part] = f'{module.page(known[part])}\n*{made_on(known[part])}.*\n'
    pages = _pages(output, list(known))
    for path, part in pages.items():
        path.write_text(
            page(known) if part == 'results' else texts[part] if part in texts
            else comparison(kept(rows), pages_of(output.name)))
    return list(pages)


def _pages(output: Path, parts: Sequence[str]) -> dict[Path, str]:
    """Return the pages that are written where these parts are known, and what each is of."""
    own = [part for part in COMPARED if part in parts and part not in (*RESULTS, *WRITTEN)]
    pages = {output: 'results'} if set(parts) & set(RESULTS) else {}
    return pages | {output.with_name(f'{part}.md'): part for part in (*own, 'comparison')}


def pages_of(results: str) -> dict[str, str]:
    """Return the file of each part of the comparison; ``results`` is that of the page itself."""
    return {part: results if part in RESULTS else f'{part}.md' for part in COMPARED}


def of_paper(part: str) -> ModuleType:
    """Return the module that makes the rows of a part in the comparison."""
    name = {'bench': 'bench_results', 'learners': 'learner_results'}.get(part, part)
    return import_module(f'..papers.{name}', __package__)


def _made(part: str, arguments: argparse.Namespace, pictured: Path,
          told: Callable[[str, float], None]) -> dict:
    if part == 'bench':
        from ..papers.bench_results import bench
        return bench(arguments.work, pictured, told)
    if part == 'learners':
        from ..papers.learner_results import learners
        return learners(arguments.work, pictured, arguments.seconds, told)
    if part in machines():
        made: dict = of_paper(part).make(arguments.work, pictured, told)
        return made
    told(part, 0.0)
    return import_module(f'..real_machines.{part}', __package__).figures(arguments.data)


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
