"""
Replay the online estimator over a bag, and draw how it followed.

  servo-identify online BAG --servo S.yaml -o DIR

writes DIR/online.csv and DIR/online.png: each quantity with two standard deviations, least
squares over windows of one time constant beside it, and the temperature where it was measured.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import new_folder, say, tell

from ..data.arguments import add_data, one_file, stretch_of

if TYPE_CHECKING:
    import numpy as np

    from servo_twin.physics.servo import Servo

    from ..data.long_bags import Long
    from ..watch.estimator.online_estimator import Snapshot

SELDOM = 100  # samples from one drawn temperature to the next
_FOREVER = 1e9  # s, a time constant that forgets nothing


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    add_data(parser, nargs=None)
    parser.add_argument('-o', '--output', type=Path, required=True, metavar='DIR')
    parser.add_argument('--time-constant', type=float, default=60.0, metavar='S',
                        help='in which it forgets (default %(default)g)')
    parser.add_argument('--every', type=float, default=1.0, metavar='S',
                        help='from one estimate to the next (default %(default)g)')


def main(arguments: argparse.Namespace) -> int:
    """Replay and draw; 1 when the bag said nothing about any quantity."""
    from servo_twin.description import servo_file

    from ..data.reading import open_one

    given = {'--time-constant': arguments.time_constant, '--every': arguments.every}
    for name, value in given.items():
        if not value > 0.0:
            raise ValueError(f'{name} = {value:g} s; it must be positive')
    servo = servo_file.load(arguments.servo)
    path = one_file(arguments.bag, 'online')
    new_folder(arguments.output, arguments.force, 'online.csv', 'online.png')
    with open_one(path, arguments.servo, arguments.mapping, arguments.namespace,
                  stretch_of(arguments)) as recording:
        return _followed(servo, recording, arguments)


def _followed(servo: Servo, recording: Long, arguments: argparse.Namespace) -> int:
    from ..data.contradictions import contradictions

    wrong = contradictions([recording], servo, despite=True)
    for one in wrong:
        print(f'warning: {one}', file=sys.stderr)
    snapshots = followed(servo, recording, arguments.time_constant, arguments.every)
    if not snapshots or not snapshots[-1].names:
        raise ValueError(f'{servo.name} has nothing that is tracked online, or '
                         f'{recording.name} is too short')
    windows = in_windows(servo, recording, arguments.time_constant)
    _write(snapshots, recording, arguments.output / 'online.csv')
    _draw(snapshots, windows, recording, servo, arguments.output / 'online.png')
    last = snapshots[-1]
    lacking = _lacking(servo, recording)
    tell(arguments, written=[arguments.output], warnings=wrong, quantities={
        name: {'value': value, 'std': std, 'unit': servo.unit(name), 'bounded': bool(bounded),
               'rows': rows}
        for name, value, std, bounded, rows in zip(last.names, last.values, last.std,
                                                   last.bounded, last.rows, strict=True)})
    for name, value, std, bounded, rows in zip(last.names, last.values, last.std, last.bounded,
                                               last.rows, strict=True):
        say(arguments, f'{name}: {value:.5g} ± {std:.2g} {servo.unit(name)}, from {rows:.0f} rows'
            + (', at a bound' if bounded else '') + ('' if rows else
               f': it needs {lacking[name]}, which was not recorded' if lacking.get(name) else
               ': it was not excited'))
    say(arguments, f'written to {arguments.output}/online.csv and online.png')
    return 0 if last.rows.any() else 1


def _lacking(servo: Servo, recording: Long) -> dict[str, str]:
    """Return the channels of each tracked quantity that a recording does not have, listed."""
    import numpy as np

    from servo_twin.recording.parts import parts_of

    from ..watch.estimator.online_estimator import OnlineEstimator

    needed = OnlineEstimator(servo, recording.period).needs
    there = {channel for part in parts_of(recording) for channel in {*sum(needed.values(), ())}
             if np.isfinite(part[channel]).any()}
    return {name: ' and '.join(one for one in channels if one not in there)
            for name, channels in needed.items()}


def followed(servo: Servo, recording: Long, time_constant: float, every: float
             ) -> list[Snapshot]:
    """Return what the estimator knew after each ``every`` s of a recording of any length."""
    from ..watch.estimator.online_estimator import OnlineEstimator

    estimator = OnlineEstimator(servo, recording.period, time_constant)
    snapshots = []
    for at, samples in _pieces(recording, max(1, round(every / recording.period))):
        estimator.push(at, samples)
        snapshots.append(estimator.snapshot())
    return snapshots


def in_windows(servo: Servo, recording: Long, seconds: float) -> list[Snapshot]:
    """Return least squares over windows of their own, for comparison; ``sequence`` is the end."""
    from ..watch.estimator.online_estimator import OnlineEstimator

    found = []
    for at, samples in _pieces(recording, round(seconds / recording.period)):
        estimator = OnlineEstimator(servo, recording.period, _FOREVER)
        estimator.push(at, samples)
        found.append(replace(estimator.snapshot(), sequence=at + len(samples) - 1))
    return found


def _pieces(recording: Long, size: int) -> Iterator[tuple[int, np.ndarray]]:
    """Yield (number of the first sample, samples) in pieces of one size; a shorter rest is not."""
    from servo_twin.recording import parts
    from servo_twin.recording.joined_samples import samples_of

    for part in parts.parts_of(recording, size * max(1, parts.SAMPLES // size)):
        samples, begin = samples_of(part.columns), part.sequence - recording.sequence
        for at in range(0, len(samples) - size + 1, size):
            yield begin + at, samples[at:at + size]


def _write(snapshots: Sequence[Snapshot], recording: Long, path: Path) -> None:
    import numpy as np

    names = snapshots[-1].names
    head = ','.join(['t', *names, *(f'std {name}' for name in names)])
    rows = [np.concatenate([[s.sequence * recording.period], s.values, s.std]) for s in snapshots]
    np.savetxt(path, rows, delimiter=',', header=head, comments='', fmt='%.8g')


def _draw(snapshots: Sequence[Snapshot], windows: Sequence[Snapshot], recording: Long,
          servo: Servo, path: Path) -> None:
    import matplotlib
    import numpy as np
    matplotlib.use('Agg')
    from matplotlib import pyplot

    from servo_twin.recording.parts import parts_of

    names = snapshots[-1].names
    warmth = np.concatenate([part['temperature'][(recording.sequence - part.sequence) % SELDOM::
                                                 SELDOM] for part in parts_of(recording)])
    warm = bool(np.isfinite(warmth).any())
    figure, axes = pyplot.subplots(len(names) + warm, 1, sharex=True, squeeze=False,
                                   figsize=(8.0, 2.0 * (len(names) + warm)))
    time = np.array([s.sequence for s in snapshots]) * recording.period
    half = 0.5 * (windows[0].sequence + 1) * recording.period if windows else 0.0
    for k, name in enumerate(names):
        axis = axes[k, 0]
        known = np.array([s.rows[k] > 0 for s in snapshots])
        value = np.array([s.values[k] for s in snapshots])
        std = np.array([s.std[k] for s in snapshots])
        axis.fill_between(time[known], (value - 2 * std)[known], (value + 2 * std)[known],
                          alpha=0.3, linewidth=0)
        axis.plot(time[known], value[known], label='online, ± 2 std')
        if windows:
            axis.plot([s.sequence * recording.period - half for s in windows],
                      [s.values[k] for s in windows], 'k.', label='least squares by window')
        axis.set_ylabel(f'{name}\n{servo.unit(name)}'.strip(), fontsize=7)
        axis.grid(alpha=0.3)
    axes[0, 0].legend(fontsize=7)
    if warm:
        axes[-1, 0].plot(np.arange(len(warmth)) * SELDOM * recording.period, warmth,
                         color='tab:red')
        axes[-1, 0].set_ylabel('gearbox\n°C', fontsize=7)
    axes[-1, 0].set_xlabel('s')
    figure.suptitle(f'{recording.name}: what the online estimator followed', fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
