"""
Run a rig, its driver, its twin and a recorder side by side, then replay what was recorded.

  servo-twin run                                      the emulated bench, driven for 20 s
  servo-twin run --family speed_ladder --duration 24  another excitation
  servo-twin run --driver odrive                      an emulated ODrive (robstride, moteus ...)
  servo-twin run --no-emulator --driver my_rig.yaml   a real drive; see docs/running.md
  servo-twin run --view --control --duration 600      with the page of `servo-twin view`
  servo-twin run --bag BAG_OR_TABLE [--servo S.yaml]  no rig: a recording instead

Ends with a table and one HTML page. Everything lies in one folder: the bag (named after the
family), the page, the logs.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
import signal
import sys
from typing import TYPE_CHECKING

from ..bringup.processes import ProcessError
from ..lockstep.live_modes import LIVE_MODES
from ..nodes.ending import SIGNALS
from .any_bag import bag_of
from .page_flags import add_port, namespace
from .terminal import add_usual, new_bag, say, tell, whole_bag

if TYPE_CHECKING:
    from ..bringup.rig_and_twin import Bench

SINE = ('amplitude=0.5', 'frequency=0.25')
"""Of the load speed, rad/s and Hz, where nothing else is said."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('--servo', metavar='S.yaml',
                        help='servo file, or the name of a shipped one (default: rv_bench, or the '
                             'one in the bag)')
    parser.add_argument('-o', '--output', type=Path, metavar='DIR',
                        help='folder to make (default recordings/<date and time>)')
    parser.add_argument('--bag', type=Path, metavar='PATH',
                        help='a bag, or a table to import, instead of a rig')
    parser.add_argument('--mapping', type=Path,
                        help='mapping file, for --bag with a table (default: the shipped '
                             'one of the servo, for MAT and JSON)')
    parser.add_argument('--mode', choices=LIVE_MODES, default='measured_input',
                        help='what drives the twin: the command that the rig received, its own '
                             'controller, or the first with correction (default %(default)s)')
    rig = parser.add_argument_group('the rig')
    rig.add_argument('--rig', type=Path, metavar='R.yaml',
                     help='rig file of the emulated rig, or the name of a shipped one (default '
                          'rv_bench)')
    rig.add_argument('--set', action='append', default=[], metavar='PATH=VALUE',
                     help='turn a property of the emulated rig, such as friction.level=1.5')
    rig.add_argument('--no-emulator', action='store_true',
                     help='a real drive, on the bus that the driver file names')
    rig.add_argument('--driver', type=Path, metavar='D.yaml',
                     help='parameter file of the driver, or the name of a shipped one, such as '
                     'odrive, with its own rig and servo file (default: ../drivers/R.yaml from '
                     'the rig file, else the shipped driver.yaml)')
    rig.add_argument('--namespace', type=namespace, default='rig',
                     help='of all nodes (default %(default)s)')
    rig.add_argument('--rate', type=_within(1.0, 1e4), metavar='HZ',
                     help='samples a second (default: as the driver file has it, else 1000)')
    rig.add_argument('--block', type=int, default=10,
                     help='samples a message (default %(default)s)')
    page = parser.add_argument_group('the page in the browser')
    page.add_argument('--view', action='store_true', help='show rig and twin, as servo-twin view')
    page.add_argument('--control', action='store_true',
                      help='with --view: let the page set values of the twin, and inject faults '
                           'into an emulated rig')
    add_port(page)
    what = parser.add_argument_group('what it does')
    what.add_argument('--family', '--experiment', default='sine',
                      help='excitation family (default %(default)s, of the load speed)')
    what.add_argument('--setting', action='append', default=[], metavar='NAME=VALUE',
                      help='of the family, such as amplitude=0.5, in the unit of what the '
                           'reference is of: V, A, rad/s or rad')
    what.add_argument('--command', choices=('voltage', 'current', 'velocity', 'position'),
                      help='what the reference is of (default: what the family is meant for; a '
                           'sine is of the load speed)')
    what.add_argument('--duration', type=_within(0.01, 1e6), default=20.0, metavar='S',
                      help='of the excitation (default %(default)s)')


def _within(low: float, high: float) -> Callable[[str], float]:
    """Return a type for argparse: a number from ``low`` to ``high``."""
    def number(text: str) -> float:
        if low <= float(text) <= high:
            return float(text)
        raise argparse.ArgumentTypeError(f'{text} is outside [{low:g}, {high:g}]')

    return number


def main(arguments: argparse.Namespace) -> int:
    """Run; 0 when the replay is the live run."""
    from ..bringup.rig_and_twin import record
    from ..description.servo_file import load
    from ..description.shipped import servo_at

    folder = arguments.output or Path(datetime.now().strftime('recordings/%Y-%m-%d_%H-%M-%S'))
    for number in SIGNALS:  # all of them end it as Ctrl-C does
        signal.signal(number, signal.default_int_handler)
    try:
        if arguments.bag is not None:
            servo = servo_at(arguments.servo) if arguments.servo else None
            with bag_of(arguments.bag, servo, arguments.mapping, folder,
                        arguments.force) as bag:
                return _look_at(bag, arguments, folder)
        bench = _bench(arguments, folder)
        load(bench.servo)
        with whole_bag(new_bag(bench.bag, arguments.force), measured=True) as place:
            outcome = record(bench, place)
        shares = ', '.join(f'{name} {share:.0%}' for name, share in outcome.cpu.items())
        tell(arguments, live=outcome.counts, cpu=outcome.cpu)
        say(arguments, f'\nlive: {outcome.counts}', f'of a core: {shares}',
            f'replay of {bench.bag}:')
        arguments.servo = None
        return _look_at(bench.bag, arguments, folder, compare=True)
    except ProcessError as problem:
        print(f'servo-twin run: {problem}', file=sys.stderr)
        return 1


def _look_at(bag: Path, arguments: argparse.Namespace, folder: Path, compare: bool = False) -> int:
    from . import replay
    command = [str(bag), '--mode', arguments.mode, '--page', str(folder / 'page.html')]
    if arguments.servo:
        command += ['--servo', arguments.servo]
    if not compare:
        command += ['-o', str(folder / 'answer')]
    parser = argparse.ArgumentParser()
    replay.add_arguments(parser)
    add_usual(parser)
    of_replay = parser.parse_args(command + ['--compare'] * compare + ['--quiet'] * arguments.quiet
                                  + ['--force'] * arguments.force)
    status = replay.main(of_replay)
    found = of_replay.found
    tell(arguments, **{**found, 'written': [bag, *found['written']]})
    return status


def _bench(arguments: argparse.Namespace, folder: Path) -> Bench:
    from ..bringup.rig_and_twin import Bench, Page
    from ..description.shipped import servo_at
    from ..physics.servo import ServoError

    settings = list(arguments.setting)
    command = arguments.command
    if arguments.family == 'sine' and command is None:
        command, settings = 'velocity', [*SINE, *settings]
    if arguments.control and not arguments.view:
        raise ServoError('--control is of the page, which --view shows')
    if folder.exists() and not arguments.force:
        raise ServoError(f'{folder} exists already; choose another folder, or --force writes '
                         'over the bag and the page in it')
    driver = None if arguments.driver is None else _driver_at(arguments.driver)
    rig = None
    if not arguments.no_emulator:
        rig = _rig_of(driver) if arguments.rig is None else _rig_at(arguments.rig)
    servo = arguments.servo
    if servo is None:
        servo = _servo_of(driver) if arguments.rig is None else 'rv_bench'
    return Bench(
        folder=folder, servo=servo_at(servo), driver=driver or _driver_of(rig), rig=rig,
        turned=tuple(arguments.set), namespace=arguments.namespace.strip('/'), mode=arguments.mode,
        rate=arguments.rate, block=arguments.block, family=arguments.family, command=command,
        settings=tuple(settings), duration=arguments.duration,
        page=Page(arguments.port, arguments.control) if arguments.view else None,
        quiet=arguments.quiet)


def _rig_at(given: Path) -> Path:
    """Return a path as it is, and for a bare name that of the shipped rig file."""
    from ..description.home_path import at_home
    from ..description.shipped import shipped

    given = at_home(given)
    named = not given.suffix and len(given.parts) == 1 and not given.is_file()
    return shipped(f'rigs/{given}.yaml') if named else given


def _driver_at(given: Path) -> Path:
    """Return the driver file that a person names: a path, or the name of a shipped one."""
    if given.is_file() or len(given.parts) > 1:
        return given
    from ..description.shipped import shipped

    return shipped(f'drivers/{given.stem}.yaml')


def _rig_of(driver: Path | None) -> Path:
    """Return the machine that an emulated drive sits on: that of the same name beside its file."""
    from ..description.shipped import shipped

    own = None if driver is None else driver.resolve().parent.parent / 'rigs' / driver.name
    return own if own is not None and own.exists() else shipped('rigs/rv_bench.yaml')


def _servo_of(driver: Path | None) -> str:
    """Return the name of the shipped servo file of a driver file's name, else rv_bench."""
    from ..description.shipped import shipped_servos

    return driver.stem if driver is not None and driver.stem in shipped_servos() else 'rv_bench'


def _driver_of(rig: Path | None) -> Path:
    """Return the driver's parameters for a rig file: dictionaries and limits of its machine."""
    from ..description.shipped import shipped

    own = None if rig is None else rig.resolve().parent.parent / 'drivers' / rig.name
    return own if own is not None and own.exists() else shipped('driver.yaml')
