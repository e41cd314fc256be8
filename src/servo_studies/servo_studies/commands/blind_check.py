"""
Record emulated rigs with effects that their twin lacks, and score the diagnosis of them.

Without options it runs the development plan and prints a table. --scored runs the seeds that
nobody looked at while the diagnosis was built, and writes docs/blind_check.md. Finished cases are
kept in the folder, so that an interrupted check goes on where it stood.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import judged_file, say, tell

from ..blind_check.case_kinds import KINDS

if TYPE_CHECKING:
    from ..blind_check import cases
    from ..blind_check.case_outcome import Outcome

_STYLE = {'right': 'green', 'partly': 'yellow', 'unknown': 'yellow', 'unseen': 'yellow',
          'wrong': 'red', 'failed': 'red'}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    which = parser.add_mutually_exclusive_group()
    which.add_argument('--scored', action='store_true', help='the frozen seeds; writes the page')
    which.add_argument('--reduced', action='store_true', help='a few cases, as in the tests')
    which.add_argument('--severities', action='store_true',
                       help='find the smallest detectable severities that are not known yet')
    parser.add_argument('--list', action='store_true', help='name the cases and do nothing')
    parser.add_argument('--case', action='append', default=[], metavar='NAME',
                        help='one case, or all whose names contain this; prints the verdict')
    parser.add_argument('--kind', action='append', default=[], choices=KINDS)
    parser.add_argument('--machine', action='append', default=[], metavar='NAME')
    parser.add_argument('--first', type=int, metavar='N',
                        help='only the first N; every beginning is a fair mix')
    parser.add_argument('--again', action='store_true', help='ask again what was answered before')
    parser.add_argument('--keep', action='store_true', help='keep the bags of each case')
    parser.add_argument('--without-baselines', action='store_true', help='the diagnosis alone')
    parser.add_argument('--resolve', action='store_true',
                        help='make the recordings proposed for ambiguous pairs, and ask again')
    parser.add_argument('--workers', type=int, default=0, help='processes; 0: all cores')
    parser.add_argument('--cluster', default='', metavar='ADDRESS',
                        help='Dask scheduler, as tcp://HOST:8786; its workers share the output '
                        'folder and have one thread each')
    parser.add_argument('-o', '--output', type=Path, default=Path('results/blind_check'),
                        help='folder of the cases (default: %(default)s)')
    parser.add_argument('--page', type=Path, help='write the page with figures there')


def main(arguments: argparse.Namespace) -> int:
    """Run the check and say how it went."""
    from ..blind_check import cases, fault_tables, severity
    from ..blind_check.blind_check_page import outcomes_in, write_page
    from ..blind_check.case_runs import forget
    from ..blind_check.scoring import figures

    if arguments.severities:
        severity.write(Path(__file__).with_name('severities.yaml'), print)
        return 0
    plan = 'scored' if arguments.scored else 'reduced' if arguments.reduced else 'development'
    chosen = _chosen(arguments, plan)
    if arguments.list:
        tell(arguments, cases=[case.name for case in chosen])
        print('\n'.join(case.name for case in chosen))
        return 0
    folder, page = arguments.output / plan, arguments.page
    if arguments.scored and page is None:
        page = fault_tables.config_folder().parent / 'docs' / 'blind_check.md'
    if page is not None:
        judged_file(page, arguments.force)
    if arguments.again:
        for case in chosen:
            forget(case, folder)
    lost = _run(chosen, folder, arguments)
    outcomes = outcomes_in(chosen, folder)
    tell(arguments, lost=lost, figures=figures(outcomes), cases=[
        {'name': one.case.name, 'verdict': one.verdict, 'status': one.status,
         'balance': one.balance, 'named': _names(one), 'sentence': one.sentence,
         'seconds': one.seconds} for one in outcomes])
    if not arguments.quiet:
        _show(outcomes)
    for name, problem in lost.items():
        print(f'{name} has no answer: {problem}; the same command asks it again', file=sys.stderr)
    if not arguments.quiet:
        _show_figures(outcomes)
    if page is not None:
        command = ' '.join(['servo-identify blind-check', *_said(arguments)])
        write_page(page, outcomes, folder, plan, command, len(cases.of_plan(plan)))
        tell(arguments, written=[page])
        say(arguments, str(page))
    return int(bool(lost))


def _said(arguments: argparse.Namespace) -> list[str]:
    said = ['--scored'] if arguments.scored else ['--reduced'] if arguments.reduced else []
    for name in ('case', 'kind', 'machine'):
        said += [f'--{name} {value}' for value in getattr(arguments, name)]
    return said + ([f'--first {arguments.first}'] if arguments.first else [])


def _chosen(arguments: argparse.Namespace, plan: str) -> list[cases.Case]:
    from ..blind_check import cases, fault_tables

    chosen = [case for case in cases.of_plan(plan)
              if (not arguments.kind or case.kind in arguments.kind)
              and (not arguments.machine or case.machine in arguments.machine)
              and (not arguments.case or any(part in case.name for part in arguments.case))]
    chosen = chosen[:arguments.first]
    if not chosen:
        raise ValueError(f'plan {plan} has no such case; --list names them; machines are '
                         f'{list(fault_tables.machines())}')
    return chosen


def _run(chosen: list[cases.Case], folder: Path, arguments: argparse.Namespace) -> dict[str, str]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    from ..blind_check.case_outcome import outcome_of
    from ..blind_check.case_runs import run_all, Wanted

    console = Console(stderr=True)
    with Progress('{task.description}', BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(),
                  console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task('cases', total=len(chosen))

        def done(case: cases.Case, seconds: float) -> None:
            progress.advance(task)
            outcome = outcome_of(case, folder / case.name)
            if seconds > 1.0 and outcome:
                console.print(f'[{_STYLE[outcome.verdict]}]{outcome.verdict:8}[/] {case.name}  '
                              f'{_names(outcome)}  ({seconds:.0f} s)', highlight=False)

        wanted = Wanted(not arguments.without_baselines, arguments.resolve, arguments.keep)
        return run_all(chosen, folder, workers=arguments.workers, cluster=arguments.cluster,
                       wanted=wanted, done=done)


def _show(outcomes: list[Outcome]) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(width=None if sys.stdout.isatty() else 160)
    table = Table(title=f'{len(outcomes)} cases', title_justify='left')
    for heading in ('case', 'is', 'verdict', 'status', 'balance', 'named', 's'):
        table.add_column(heading, overflow='fold')
    for one in outcomes:
        table.add_row(one.case.name, ' + '.join(
            f'{t.fault} {t.severity:.3g} ({t.multiple:g}x)' for t in one.case.truths) or 'nothing',
            f'[{_STYLE[one.verdict]}]{one.verdict}[/]', one.status,
            ('' if one.located or not one.case.truths else '[red]') + one.balance,
            _names(one) or one.sentence, f'{one.seconds or 0.0:.0f}')
    console.print(table)
    if len(outcomes) == 1:
        console.print(outcomes[0].sentence, highlight=False)


def _show_figures(outcomes: list[Outcome]) -> None:
    from rich.console import Console
    from rich.table import Table

    from ..blind_check.scoring import figures

    table = Table(title='Figures', title_justify='left')
    for heading in ('cases', 'figure', 'value', 'n', 'goal'):
        table.add_column(heading)
    for one in figures(outcomes):
        if one.of:
            colour = {None: '', True: '[green]', False: '[red]'}[one.met]
            value = f'{100 * one.value:.0f} %' if one.share else f'{one.value:.2f}'
            table.add_row(one.kind, one.name, colour + value, str(one.of), one.goal)
    Console(width=None if sys.stdout.isatty() else 130).print(table)


def _names(outcome: Outcome) -> str:
    return ', '.join(n.effect + (f'@{n.site}' if n.site else '')
                     + (f' (or {"/".join(n.alike)})' if n.alike else '') for n in outcome.named)
