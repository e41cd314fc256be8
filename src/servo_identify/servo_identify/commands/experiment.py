"""
Drive a rig through a procedure and record a bag of each part of it.

  servo-identify experiment --list
  servo-identify experiment friction -o bags --servo rv_bench --bringup    the emulated bench
  servo-identify experiment friction -o bags --servo rv_bench              the rig that runs
  servo-identify experiment friction -o bags --servo rv_bench --headless   emulated, no bus

The plan is refused when it would exceed a limit; while it runs, every sample is judged, and the
motor is brought to rest before the limit. Ctrl-C, Ctrl-Z and a closed terminal do the same and
leave a usable bag.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
import signal
import sys
from typing import TYPE_CHECKING

from servo_twin.bringup.processes import ProcessError, Processes, wait_until
from servo_twin.commands.terminal import named_servo, new_bag, say, tell, whole_bag
from servo_twin.description.nearest_name import or_what
from servo_twin.nodes.ending import SIGNALS
from servo_twin.physics.straight_units import straightened

from ..experiment.usual_limits import UNITS, USUAL

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from servo_twin.physics.servo import Servo

    from ..experiment.procedures import Run
    from ..experiment.run_limits import Limits

_WAIT = 30.0  # s for the rig and for the recorder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('procedures', nargs='*', metavar='NAME', help='of the list, or all')
    parser.add_argument('--list', action='store_true', help='say what procedures there are')
    parser.add_argument('-o', '--output', type=Path, metavar='DIR', help='folder of the bags')
    parser.add_argument('--servo', type=named_servo, default='rv_bench', metavar='S.yaml',
                        help='servo file that goes into the bags (default %(default)s)')
    where = parser.add_argument_group('the rig')
    where.add_argument('--namespace', default='rig', help='default %(default)s')
    where.add_argument('--bringup', action='store_true',
                       help='start the emulated bench and its driver')
    where.add_argument('--headless', action='store_true',
                       help='the emulated rig without bus and driver, faster than real time')
    where.add_argument('--rig', type=Path, metavar='R.yaml', help='emulated: its rig file')
    where.add_argument('--set', action='append', default=[], metavar='PATH=VALUE',
                       help='emulated: turn a property, such as friction.level=1.5')
    where.add_argument('--seed', type=int, default=0, help='headless: of the sensor noise')
    where.add_argument('--rate', type=float, default=1000.0, metavar='HZ',
                       help='set-points and samples a second (default %(default)g)')
    what = parser.add_argument_group('what is left to you; left out: as the procedure says')
    for name, unit in (('speeds', 'rad/s at the load'), ('torques', 'N m at the load'),
                       ('amplitudes', 'V'), ('frequencies', 'Hz')):
        what.add_argument(f'--{name}', type=float, nargs='+', default=(), help=unit)
    what.add_argument('--angle', type=float, metavar='RAD', help='of the load, instead of a turn')
    what.add_argument('--duration', type=float, metavar='S', help='of what repeats itself')
    what.add_argument('--replicates', type=int, default=1, help='of each recording')
    limits = parser.add_argument_group('limits')
    for name, unit in UNITS.items():
        limits.add_argument(f'--max-{name}', type=float, metavar=unit.replace(' ', '_'),
                            help=f'default {USUAL[name]:g} {unit}'
                            + f'; of a linear axis in {straightened(unit)}, and must be given'
                            * (name != 'current'))


def main(arguments: argparse.Namespace) -> int:
    """Perform; 0 when all was recorded, 1 when it ended early."""
    from servo_twin.description import servo_file

    from ..experiment.procedures import PROCEDURES
    from ..experiment.run_limits import limits_of

    if arguments.list:
        tell(arguments, procedures={p.name: p.summary for p in PROCEDURES.values()})
        print('\n'.join(f'{p.name:<20}{p.summary}' for p in PROCEDURES.values()))
        return 0
    servo, path = servo_file.load(arguments.servo), arguments.servo
    limits = limits_of(servo, {name: getattr(arguments, f'max_{name}') for name in UNITS})
    runs = planned(arguments, servo, limits)
    if arguments.output is None:
        raise ValueError('say by -o where the bags shall go')
    for run in runs:
        new_bag(arguments.output / run.name, arguments.force)
    tell(arguments, runs=[{'name': run.name, 'family': run.family, 'mode': run.mode,
                           'replicate': run.replicate, 'duration': run.duration}
                          for run in runs])
    if arguments.headless:
        return _headless(arguments, runs, servo, path)
    try:
        return _live(arguments, runs, limits, path)
    except ProcessError as problem:
        print(f'servo-identify experiment: {problem}', file=sys.stderr)
        return 1


def planned(arguments: argparse.Namespace, servo: Servo, limits: Limits) -> list[Run]:
    """Return all runs that were asked for; raises ValueError for one beyond a limit."""
    from ..experiment.procedures import Choices, PROCEDURES

    names = list(PROCEDURES) if arguments.procedures == ['all'] else arguments.procedures
    unknown = [name for name in names if name not in PROCEDURES]
    if unknown or not names:
        raise ValueError(f'there is no procedure {unknown[0]!r}; '
                         f'{or_what(unknown[0], PROCEDURES)}'
                         if unknown else f'name a procedure of {list(PROCEDURES)}')
    if not 100.0 <= arguments.rate <= 20_000.0:
        raise ValueError(f'--rate {arguments.rate:g} Hz is outside [100, 20000]')
    choices = Choices(1.0 / arguments.rate, arguments.replicates, tuple(arguments.speeds),
                      tuple(arguments.torques), tuple(arguments.amplitudes),
                      tuple(arguments.frequencies), arguments.angle, arguments.duration)
    runs = [run for name in names for run in PROCEDURES[name].runs(choices)]
    gain = servo.values.get('drive.gain') if 'drive.resistance' not in servo.values else None
    for run in runs:
        limits.check(run, gain)
    return runs


def _bar(console: Console) -> Progress:
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    return Progress(TextColumn('{task.description}'), BarColumn(), TextColumn(
        '{task.percentage:>3.0f} %'), TimeRemainingColumn(), console=console,
        disable=not console.is_terminal)


def _headless(arguments: argparse.Namespace, runs: Sequence[Run], servo: Servo, path: Path
              ) -> int:
    from rich.console import Console

    from servo_twin.description.shipped import shipped

    from ..experiment.offline_bench import make

    rig = arguments.rig or shipped('rigs/rv_bench.yaml')
    text = path.read_text()
    with _bar(Console(stderr=True)) as bar, ThreadPoolExecutor(2) as workers:
        task, written = bar.add_task('emulating', total=len(runs)), []
        def made(k: int, run: Run) -> Path:
            with whole_bag(arguments.output / run.name) as place:
                make(run, place.parent, rig, servo.name, text, arguments.set, arguments.seed + k,
                     arguments.namespace.strip('/'))
            return arguments.output / run.name
        futures = [workers.submit(made, k, run) for k, run in enumerate(runs)]
        try:
            for future in futures:
                written.append(future.result())
                tell(arguments, written=written)
                say(arguments, str(written[-1]))
                bar.advance(task)
        finally:
            workers.shutdown(cancel_futures=True)
    return 0


def _live(arguments: argparse.Namespace, runs: Sequence[Run], limits: Limits, servo: Path) -> int:
    from rich.console import Console

    from servo_twin.description.shipped import shipped

    from ..experiment.live_bench import emulated_bench, START
    from ..experiment.performer_node import Performer, Stopped

    namespace = arguments.namespace.strip('/')
    with ExitStack() as stack:
        processes = stack.enter_context(Processes(arguments.output / 'logs'))
        if arguments.bringup:
            stack.enter_context(emulated_bench(
                processes, namespace, arguments.rig or shipped('rigs/rv_bench.yaml'),
                shipped('driver.yaml'), arguments.rate, arguments.set))
        performer = stack.enter_context(Performer(namespace, limits))
        for number in SIGNALS:
            signal.signal(number, lambda *_: performer.interrupt())
        bar, written = stack.enter_context(_bar(Console(stderr=True))), []
        try:
            performer.begin(START if arguments.bringup else _WAIT)
            for run in runs:
                performer.home()
                with whole_bag(arguments.output / run.name, measured=True) as place:
                    _record(run, place, arguments, performer, processes, bar, servo)
                written.append(arguments.output / run.name)
                say(arguments, str(written[-1]))
                tell(arguments, written=written)
        except Stopped as problem:
            tell(arguments, ended_early=str(problem))
            print(f'ended early: {problem}; {performer.stands}', file=sys.stderr)
            return 1
        finally:
            most = performer.guard.most if performer.guard else {}
            tell(arguments, largest=most)
            say(arguments, 'largest: ' + ', '.join(
                f'{name} {size:.4g}' for name, size in most.items()))
    return 0


def _record(run: Run, bag: Path, arguments: argparse.Namespace, performer,
            processes: Processes, bar: Progress, servo: Path) -> None:
    from ..experiment.live_bench import python, ros

    name = f'recorder_{run.name}'
    processes.start(name, [*python('servo_rig_driver.record.recorder_node'), *ros(
        arguments.namespace.strip('/'), {
            'output': bag, 'servo_file': servo, 'family': run.family,
            'replicate': run.replicate, 'note': f'servo-identify experiment, {run.mode}'})],
        may_end=True)
    task = bar.add_task(run.name, total=1.0)
    try:
        wait_until(lambda: 'recording to' in processes.said(name), 'the recorder is there',
                   _WAIT, processes)
        performer.recorded(bag, _WAIT)
        say(arguments, f'playing {run.name}')
        performer.perform(run, lambda share: bar.update(task, completed=share))
    finally:
        processes.stop(name)
