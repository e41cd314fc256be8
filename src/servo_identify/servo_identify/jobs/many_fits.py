"""Several fits side by side: progress, a servo file and a report for each, one table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
import sys
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from .cluster import Finished, scattered
from .fit_jobs import Answer, Job, run

SHOWN = 4
"""Values of a fit that the table has room for; the files hold all."""


def run_all(jobs: Mapping[str, Job], folder: Path, address: str = '', workers: int = 0,
            quiet: bool = False) -> list[Finished]:
    """
    Do jobs on a cluster; write NAME.yaml and NAME.json into a folder as each ends.

    Returns how each ended; the table, left out when ``quiet``, says which failed, and why.
    ``address`` and ``workers`` as of :func:`..cluster.scattered`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    console, ended = Console(stderr=True), {}
    columns = ('{task.description}', BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task('fits', total=len(jobs))
        tasks = {name: (job,) for name, job in jobs.items()}
        for done in scattered(run, tasks, address=address, workers=workers):
            ended[done.name] = done
            _keep(done, folder)
            bar.advance(task)
            if done.problem or not quiet:
                console.print(f'{done.name}: {done.problem or "done"}', markup=False,
                              highlight=False, style='red' if done.problem else '')
    if not quiet:
        _show([ended[name] for name in jobs])
        print(f'written to {folder}')
    return [ended[name] for name in jobs]


def told(done: Finished) -> dict[str, Any]:
    """Return how a fit ended as plain data, without the servo."""
    found = done.answer.estimate if done.answer else None
    return {'name': done.name, 'problem': done.problem, 'seconds': done.seconds,
            'values': found.values if found else {}, 'std': found.std if found else {},
            'warnings': list(found.warnings) if found else []}


def _keep(done: Finished, folder: Path) -> None:
    from servo_twin.description import servo_file

    if not done.problem:
        servo_file.save(done.answer.servo, folder / f'{done.name}.yaml')
        if done.answer.estimate:
            done.answer.estimate.save(folder / f'{done.name}.json')


def _show(ended: list[Finished]) -> None:
    failed = sum(bool(done.problem) for done in ended)
    table = Table(title=f'{len(ended)} fits, {failed} failed', title_justify='left')
    for heading in ('fit', 's', 'steps', 'residual over noise floor', 'warnings', 'result'):
        table.add_column(heading, overflow='fold',
                         justify='right' if heading in ('s', 'steps') else 'left')
    for done in ended:
        if done.problem:
            table.add_row(done.name, f'{done.seconds:.1f}', '', '', '', Text(done.problem, 'red'))
        else:
            table.add_row(done.name, f'{done.seconds:.1f}', *_told(done.answer))
    Console(width=None if sys.stdout.isatty() else 140).print(table)


def _told(answer: Answer) -> tuple[str, str, str, str]:
    found = answer.estimate
    if found is None:
        return '', '', '', '; '.join(answer.said)
    left = ', '.join(f'{channel} {rms / found.noise[channel]:.3g}'
                     for channel, rms in found.rms.items())
    values = ', '.join(f'{name.partition(".")[2]} {found.values[name]:.5g} ± '
                       f'{found.std[name]:.2g}' for name in found.names[:SHOWN])
    more = len(found.names) - SHOWN
    return (str(found.iterations), left, '; '.join(found.warnings),
            values + (f' and {more} more' if more > 0 else ''))
