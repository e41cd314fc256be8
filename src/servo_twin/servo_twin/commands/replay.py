"""
Run the twin over a bag, and say how well it answers.

  servo-twin replay BAG                          with the servo file that is stored in the bag
  servo-twin replay BAG --servo S.yaml -o OUT    writes predictions and residuals as a bag
  servo-twin replay BAG --mode closed_loop       its own controller drives, as its reference says
  servo-twin replay BAG --compare                are they those of the live run, to the last bit?
  servo-twin replay BAG --graph --rate 0.5       plays the samples into ROS, at half the speed
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
import shutil
import sys
from time import perf_counter
from typing import TYPE_CHECKING

from ..lockstep.live_modes import LIVE_MODES
from ..recording.events import as_for_another, BEGAN, with_mode
from .any_bag import bag_of
from .terminal import named_servo, new_bag, new_file, tell, terminal, whole_bag

if TYPE_CHECKING:
    from rich.console import Console

    from ..balances.goodness_of_fit import Fit
    from ..lockstep.whole_recording import Answering
    from ..physics.servo import Servo
    from ..recording.events import Change, Happened
    from ..recording.parts import LongRecording
    from ..recording.recording import Predictions, Recording


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('bag', type=Path, metavar='BAG',
                        help='bag, MCAP file or table; the latter with --servo')
    parser.add_argument('--mapping', type=Path, metavar='M.yaml',
                        help='how columns of a table, or fields of messages, become channels')
    parser.add_argument('--servo', type=named_servo, metavar='S.yaml',
                        help='servo file, or the name of a shipped one; left out: the one stored '
                             'in the bag')
    parser.add_argument('--effects', metavar='FOLDER', help='folder of effect files of your own')
    parser.add_argument('-o', '--output', type=Path, metavar='OUT',
                        help='write rig, predictions and residuals as a bag')
    parser.add_argument('--page', type=Path, metavar='PAGE.html', help='write a page about it')
    parser.add_argument('--mode', choices=LIVE_MODES,
                        help='what drives the twin. measured_input: the recorded command; '
                             'closed_loop: the controller of the servo file, under the recorded '
                             'reference; observer: the recorded command, and the encoders correct '
                             'it. Left out: as the twin in the bag ran, else '
                             f'{LIVE_MODES[0]}')
    parser.add_argument('--namespace', help='which rig, of a bag with several')
    parser.add_argument('--stretch', type=int,
                        help='which part of a bag whose driver was restarted; left out: the '
                             'longest')
    parser.add_argument('--compare', action='store_true',
                        help='compare with the predictions in the bag, bit by bit')
    parser.add_argument('--graph', action='store_true',
                        help='publish the samples and /clock instead of answering them')
    parser.add_argument('--rate', type=float, default=1.0,
                        help='times real time, with --graph (default %(default)s)')


def main(arguments: argparse.Namespace) -> int:
    """Replay; returns 1 when --compare finds a difference."""
    from ..physics import catalogue

    if arguments.graph:
        from ..nodes.graph_replay import play
        return play(arguments.bag, arguments.rate, arguments.namespace, arguments.stretch)
    if arguments.effects:
        catalogue.register(arguments.effects)
    if arguments.page:
        new_file(arguments.page, arguments.force)
    if arguments.output:
        new_bag(arguments.output, arguments.force)
    with bag_of(arguments.bag, arguments.servo, arguments.mapping) as bag:
        arguments.bag = bag
        return _answered(arguments)


def _answered(arguments: argparse.Namespace) -> int:
    from ..bag import open_predictions, open_recording, read_events
    from ..lockstep.live_comparison import began_before, Differences, Seen
    from ..lockstep.lockstep import Settings, warm_up
    from ..lockstep.whole_recording import Answering
    from ..pages.replay_page import Replayed, write_page

    console = terminal(quiet=arguments.quiet)
    where = arguments.bag, arguments.namespace, arguments.stretch
    with ExitStack() as opened:
        begin = perf_counter()
        recording: LongRecording = opened.enter_context(open_recording(*where))
        coupled = recording.has('coupled_position')
        servo = servo_of(recording, arguments.servo)
        changes = _changes(arguments, recording)
        compared, early = None, 0
        if arguments.compare:
            live = opened.enter_context(open_predictions(*where))
            early = began_before(recording, changes)
            recording = Seen(recording, live, changes)
            compared = Differences(live, recording.balanced)
        looked = perf_counter()
        warm_up(servo)
        ready = perf_counter()
        mode = arguments.mode or (changes[0].values['mode'] if changes and changes[0].kind == BEGAN
                                  else LIVE_MODES[0])
        answering = Answering(recording, servo, Settings(mode=mode), changes)
        replayed = Replayed(servo, recording, drawn=bool(arguments.page))
        for part, answer in _written(answering, arguments, coupled):
            replayed.add(part, answer)
            if compared:
                compared.add(answer)
        took = perf_counter() - ready + looked - begin
        warnings = [*recording.warnings, *answering.warnings]
        console.print(f'[bold]{recording.name}[/]: {recording.duration:.4g} s of {servo.name} at '
                      f'{1.0 / recording.period:.6g} Hz, {mode}; read'
                      f'{", answered and written" if arguments.output else " and answered"} in '
                      f'{took:.3g} s, {recording.duration / took:.0f} times as fast as it was')
        happened = read_events(arguments.bag, arguments.namespace)
        _show(console, recording, replayed.fit, warnings, happened)
        tell(arguments, recording=recording.name, servo=servo.name, period=recording.period,
             duration=recording.duration, channels=[vars(one) for one in replayed.fit.channels],
             balances=[vars(one) for one in replayed.fit.balances], warnings=warnings,
             written=[one for one in (arguments.output, arguments.page) if one])
        if arguments.page:
            page = write_page(arguments.page, servo, recording, replayed, mode, warnings, happened)
            console.print(f'page: {page}', highlight=False, soft_wrap=True)
    if arguments.output:
        console.print(f'bag: {arguments.output}', highlight=False, soft_wrap=True)
    if compared is None:
        return 0
    tell(arguments, differences=compared.found)
    status = say_differences(compared.found, arguments.quiet)
    if status and early:
        print(f'the live twin began {early} samples before the bag does, and a replay can only '
              'begin where the bag does: start the recorder before the twin', file=sys.stderr)
    return status


def _written(answering: Answering, arguments: argparse.Namespace,
             coupled: bool) -> Iterator[tuple[Recording, Predictions]]:
    """Yield the parts of a replay, written as a bag where one is asked for."""
    from ..bag import RecordingWriter
    from ..physics.servo import ServoError

    if not arguments.output:
        yield from answering
        return
    with whole_bag(arguments.output) as place:
        try:
            with RecordingWriter(place, namespace=arguments.namespace or '',
                                 coupled=coupled) as bag:
                for part, answer in answering:
                    bag.add(part, answer)
                    yield part, answer
        except ServoError:
            shutil.rmtree(place)
            raise


def _show(console: Console, recording: LongRecording, fit: Fit, warnings: list[str],
          happened: list[Happened]) -> None:
    from ..pages.event_table import event_table
    from ..pages.fit_table import balance_table, channel_table

    for warning in warnings:
        console.print(f'[yellow]{warning}[/]')
    console.print(channel_table(fit))
    if fit.balances:
        console.print(balance_table(fit))
    if happened:
        console.print(event_table(happened, recording.start))


def _changes(arguments: argparse.Namespace, recording: LongRecording) -> list[Change]:
    """Return what the replay obeys: with a servo or a mode of the user's, only what it leaves."""
    from ..bag import read_changes

    changes = read_changes(arguments.bag, arguments.namespace, recording)
    if arguments.servo:
        changes = as_for_another(changes)
    if arguments.mode:
        changes = with_mode(changes, arguments.mode)
    return changes


def servo_of(recording: LongRecording, given: Path | None) -> Servo:
    """Return the servo of a file, or the one stored with the recording; raises ServoError."""
    from ..description.servo_file import load, loads
    from ..physics.servo import ServoError

    if given is not None:
        return load(given)
    if not recording.servo_file:
        raise ServoError(f'{recording.name}: no servo file is stored in it; give one by --servo')
    return loads(recording.servo_file, f'servo file in {recording.name}', code=False)


def say_differences(found: dict[str, int], quiet: bool = False) -> int:
    """Print whether a replay is the live run, bit by bit; return the exit status."""
    wrong = {name: count for name, count in found.items() if count}
    if not wrong:
        if not quiet:
            print('replay and live run are identical to the last bit')
        return 0
    listed = ', '.join(f'{name} at {count} samples' for name, count in wrong.items())
    print(f'replay and live run differ: {listed}', file=sys.stderr)
    return 1
