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
from ..recording.events import Change, SERVO_FILE
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
    NaN. ``changes`` act before the samples of their running numbers. Raises ServoError when the
    recording holds nothing that the twin could run on.
    """
    line = Lockstep(servo, recording.period, settings)
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
            _change(line, waiting.popleft())
        block = {name: column[begin:end] for name, column in recording.columns.items()}
        prediction, due = line.step(begin, 0, samples_of(block))
        y[:, begin:end] = prediction.values.T
        fill(due)
    fill(line.finish())
    warnings = []
    if line.twin.restarts:
        warnings.append(f'the twin began again {line.twin.restarts} times: {line.twin.why}')
    if not present.all():
        warnings.append(f'{int((~present).sum())} samples are missing; '
                        f'{line.twin.bridged} were bridged')
    return Predictions(
        name=recording.name, period=recording.period,
        prediction=dict(zip(PREDICTED, y, strict=True)),
        residual=dict(zip(COMPARED + BALANCES, gap, strict=True)),
        channel_noise=line.balances.channel_noise, balance_noise=line.balances.noise,
        start=recording.start, sequence=recording.sequence, restarts=line.twin.restarts,
        warnings=tuple(warnings))


def _change(line: Lockstep, change: Change) -> None:
    if change.kind == SERVO_FILE:
        line.load(servo_file.loads(change.content, 'a servo file loaded while it was recorded'))
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


def seen_by(recording: Recording, live: Predictions, window: float = WINDOW) -> Recording:
    """
    Return the samples of a recording that the live twin had seen when it was last heard.

    Its residuals come half a ``window``, s, late: a last one that is no NaN saw so much more.
    """
    late = any(np.isfinite(live.residual[name][-1]) for name in BALANCES)
    ahead = half_of(window, live.period) if late else 0
    return part_of(recording, live.sequence, live.sequence + len(live) + ahead)


def differences(live: Predictions, again: Predictions) -> dict[str, int]:
    """
    Count the samples of each channel and balance that differ in any bit, where both answer.

    Only samples that the live twin answered count; NaN equals NaN. Raises ServoError when the two
    share no sample.
    """
    first = max(live.sequence, again.sequence)
    end = min(live.sequence + len(live), again.sequence + len(again))
    if first >= end:
        raise ServoError(f'{live.name}: the live twin answered samples {live.sequence} to '
                         f'{live.sequence + len(live) - 1}, the replay others')
    sides = [slice(first - p.sequence, end - p.sequence) for p in (live, again)]
    answered = ~np.isnan(live.prediction['voltage'][sides[0]])
    found = {}
    for part in ('prediction', 'residual'):
        for name, values in getattr(live, part).items():
            one, other = values[sides[0]], getattr(again, part)[name][sides[1]]
            same = (one == other) | (np.isnan(one) & np.isnan(other))
            found[f'{part} {name}'] = int((answered & ~same).sum())
    return found
