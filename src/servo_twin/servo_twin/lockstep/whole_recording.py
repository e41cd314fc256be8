"""A whole recording through the twin: the same steps as beside a live rig, to the last bit."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..balances.residual_filters import half_of, WINDOW
from ..description import servo_file
from ..physics.servo import Servo, ServoError
from ..recording.events import BEGAN, Change, SERVO_FILE, SETTINGS
from ..recording.joined_samples import samples_of
from ..recording.recording import BALANCES, COMPARED, PREDICTED, Predictions, Recording
from .lockstep import Answer, Lockstep, Settings

_AS_DECLARED = Settings()
_BLOCK = 1 << 12  # samples a step, so that what is passed on stays near the core
_MUST_ARRIVE = (('motor_position', 'load_position'),
                ('current', 'voltage', 'current_reference', 'reference_velocity',
                 'reference_position', 'temperature'))
"""Columns that travel together; a sample that lacks all of a group was lost on its way."""


def answer(recording: Recording, servo: Servo, settings: Settings = _AS_DECLARED,
           changes: Sequence[Change] = ()) -> Predictions:
    """
    Return what a twin answers to a recording.

    Samples that were lost are stepped over as the live twin steps over them, and answered with
    NaN. ``changes`` act before the samples of their running numbers: where the live twin began, a
    twin begins here. Raises ServoError when the recording holds nothing that the twin could run
    on.
    """
    line = Lockstep(servo, recording.period, settings)
    lines = [line]
    present = _present(recording, settings.mode)
    y = np.empty((len(PREDICTED), len(recording)))
    gap = np.empty((len(COMPARED) + len(BALANCES), len(recording)))
    y[:, ~present] = gap[:, ~present] = np.nan

    def fill(parts: list[Answer]) -> None:
        for part in parts:
            gap[:, part.sequence:part.sequence + len(part.values)] = part.values.T

    waiting = deque(changes)
    cuts = [change.sequence - recording.sequence for change in changes]
    for begin, end in _stretches(present, cuts):
        while waiting and waiting[0].sequence - recording.sequence <= begin:
            change = waiting.popleft()
            if change.kind == BEGAN:
                fill(line.finish())
                line = _begun(change, servo, recording.period)
                lines.append(line)
            else:
                _change(line, change)
        block = {name: column[begin:end] for name, column in recording.columns.items()}
        prediction, due = line.step(begin, 0, samples_of(block))
        y[:, begin:end] = prediction.values.T
        fill(due)
    fill(line.finish())
    warnings = []
    restarts = sum(one.twin.restarts for one in lines)
    if restarts:
        why = next(one.twin.why for one in reversed(lines) if one.twin.restarts)
        warnings.append(f'the twin began again {restarts} times: {why}')
    if not present.all():
        warnings.append(f'{int((~present).sum())} samples are missing; '
                        f'{sum(one.twin.bridged for one in lines)} were bridged')
    return Predictions(
        name=recording.name, period=recording.period,
        prediction=dict(zip(PREDICTED, y, strict=True)),
        residual=dict(zip(COMPARED + BALANCES, gap, strict=True)),
        channel_noise=line.balances.channel_noise, balance_noise=line.balances.noise,
        start=recording.start, sequence=recording.sequence, restarts=restarts,
        warnings=tuple(warnings))


def _begun(change: Change, servo: Servo, period: float) -> Lockstep:
    fields = change.values
    text = fields.pop('servo_file')
    if text:
        servo = servo_file.loads(text, 'the servo file that the live twin began with', code=False)
    return Lockstep(servo, period, Settings(**fields))


def _change(line: Lockstep, change: Change) -> None:
    if change.kind == SERVO_FILE:
        line.load(servo_file.loads(change.content, 'a servo file loaded while it was recorded',
                                   code=False))
    elif change.kind == SETTINGS:
        line.follow(Settings(**change.values))
    else:
        line.set(change.values)


def _present(recording: Recording, mode: str) -> np.ndarray:
    present = np.ones(len(recording), dtype=bool)
    for group in _MUST_ARRIVE:
        known = np.zeros(len(recording), dtype=bool)
        for name in group:
            known |= ~np.isnan(recording[name])
            if known.all():
                break
        if not known.any():
            raise ServoError(f'{recording.name}: none of {list(group)} was recorded; '
                             f'a twin in {mode} needs them')
        present &= known
    if mode != 'closed_loop':
        if not recording.has('voltage'):
            raise ServoError(f'{recording.name}: voltage was not recorded; a twin in {mode} '
                             f'runs on it')
        present &= ~np.isnan(recording['voltage'])  # a drive that is off has no command
    return present


def _stretches(present: np.ndarray, cuts: Sequence[int]) -> list[tuple[int, int]]:
    """Return (begin, end) of what is stepped at once: nothing missing and no cut within."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], present.astype(np.int8), [0]))))
    found = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        marks = [int(begin), *sorted({cut for cut in cuts if begin < cut < end}), int(end)]
        found += [(at, min(last, at + _BLOCK)) for first, last in pairwise(marks)
                  for at in range(first, last, _BLOCK)]
    return found


def part_of(recording: Recording, first: int, end: int) -> Recording:
    """Return the samples with running numbers from ``first`` to ``end``, as far as there are."""
    cut = slice(min(max(0, first - recording.sequence), len(recording)),
                min(max(0, end - recording.sequence), len(recording)))
    return replace(recording, columns={n: c[cut] for n, c in recording.columns.items()},
                   start=recording.start + cut.start * recording.period,
                   sequence=recording.sequence + cut.start)


def seen_by(recording: Recording, live: Predictions, changes: Sequence[Change] = (),
            window: float = WINDOW) -> Recording:
    """
    Return the samples of a recording that the live twin had seen when it was last heard.

    It begins where the twin did, as ``changes`` say, though the recorder may have heard it later.
    Samples that it left out, because it was behind, are NaN. Residuals come half a
    ``window``, s, late: a last one that is no NaN saw so much more.
    """
    late = any(np.isfinite(live.residual[name][-1]) for name in BALANCES)
    ahead = half_of(window, live.period) if late else 0
    begun = [one.sequence for one in changes if one.kind == BEGAN
             and recording.sequence <= one.sequence <= live.sequence]
    seen = part_of(recording, max(begun, default=live.sequence),
                   live.sequence + len(live) + ahead)
    unanswered = np.isnan(live.prediction['voltage'])
    if not unanswered.any():
        return seen
    at = live.sequence - seen.sequence + np.flatnonzero(unanswered)
    columns = {name: column.copy() for name, column in seen.columns.items()}
    for column in columns.values():
        column[at] = np.nan
    return replace(seen, columns=columns)


def began_before(recording: Recording, changes: Sequence[Change]) -> int:
    """Return how many samples before a recording its live twin began, as far as that is known."""
    begun = [one.sequence for one in changes if one.kind == BEGAN]
    return max(0, recording.sequence - begun[0]) if begun else 0


def differences(live: Predictions, again: Predictions) -> dict[str, int]:
    """
    Count the samples of each channel and balance that differ in any bit, where both answer.

    Only samples that the live twin answered count, and residuals that it published: the last half
    window of one that was killed never was. NaN equals NaN. Raises ServoError when the two share
    no sample.
    """
    first = max(live.sequence, again.sequence)
    end = min(live.sequence + len(live), again.sequence + len(again))
    if first >= end:
        raise ServoError(f'{live.name}: the live twin answered samples {live.sequence} to '
                         f'{live.sequence + len(live) - 1}, the replay others')
    sides = [slice(first - p.sequence, end - p.sequence) for p in (live, again)]
    told = {'prediction': ~np.isnan(live.prediction['voltage'][sides[0]]),
            'residual': np.any([~np.isnan(values[sides[0]])
                                for values in live.residual.values()], axis=0)}
    found = {}
    for part, heard in told.items():
        for name, values in getattr(live, part).items():
            one, other = values[sides[0]], getattr(again, part)[name][sides[1]]
            same = (one == other) | (np.isnan(one) & np.isnan(other))
            found[f'{part} {name}'] = int((heard & ~same).sum())
    return found
