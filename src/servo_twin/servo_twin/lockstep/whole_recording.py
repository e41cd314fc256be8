"""A recording of any length through the twin: the same steps as beside a live rig, bit by bit."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..description import servo_file
from ..physics.servo import Servo, ServoError
from ..recording.events import BEGAN, Change, SERVO_FILE, SETTINGS, ZERO
from ..recording.joined_samples import reference_of, samples_of
from ..recording.parts import Long, parts_of
from ..recording.recording import BALANCES, COMPARED, PREDICTED, Predictions, Recording
from .lockstep import Answer, Lockstep, Settings

_AS_DECLARED = Settings()
_BLOCK = 1 << 12  # samples a step, so that what is passed on stays near the core
_MUST_ARRIVE = (('motor_position', 'load_position'),
                ('current', 'voltage', 'current_reference', 'reference_velocity',
                 'reference_position', 'temperature'))
"""Columns that travel together; a sample that lacks all of a group was lost on its way."""


@dataclass(frozen=True)
class _Part:
    """A part that is answered, of samples from ``begin`` on counted from the recording's first."""

    recording: Recording
    begin: int
    prediction: np.ndarray
    residual: np.ndarray

    @property
    def end(self) -> int:
        return self.begin + len(self.recording)


class Answering:
    """
    A twin that answers a recording part by part, its state carried over.

    To iterate gives each part with its answer, once all residuals of it are complete: one part
    late. Samples that were lost are stepped over as the live twin steps over them, and answered
    with NaN. ``changes`` act before the samples of their running numbers: where the live twin
    began, a twin begins here. Iterating raises ServoError, after the last part, when the recording
    holds nothing that the twin could run on.
    """

    def __init__(self, recording: Long[Recording], servo: Servo, settings: Settings = _AS_DECLARED,
                 changes: Sequence[Change] = ()) -> None:
        self._recording, self._servo, self._mode = recording, servo, settings.mode
        self._lines = [Lockstep(servo, recording.period, settings)]
        self._changes = deque(changes)
        self._cuts = [change.sequence - recording.sequence for change in changes]
        self._parts: deque[_Part] = deque()
        self._recorded: set[tuple[str, ...]] = set()
        self._driving = (reference_of(servo), 'voltage') if self._mode == 'closed_loop' else ()
        self._driven: set[str] = set()
        self._missing = 0

    def __iter__(self) -> Iterator[tuple[Recording, Predictions]]:
        for part in parts_of(self._recording):
            self._take(part)
            yield from self._complete()
        self._fill(self._lines[-1].finish())
        yield from self._complete()
        lacking = [group for group in self._groups() if group not in self._recorded]
        if self._driving and not self._driven:
            lacking.append(tuple(filter(None, self._driving)))
        if lacking:
            group = lacking[0]
            said = f'none of {list(group)} was' if len(group) > 1 else f'{group[0]} was not'
            raise ServoError(f'{self._recording.name}: {said} recorded; a twin in {self._mode} '
                             'needs it')

    @property
    def restarts(self) -> int:
        """How often the twin began again so far."""
        return sum(line.twin.restarts for line in self._lines)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be said of the answer so far."""
        said = []
        if self.restarts:
            why = next(one.twin.why for one in reversed(self._lines) if one.twin.restarts)
            said.append(f'the twin began again {self.restarts} times: {why}')
        if self._driven == {'voltage'}:
            said.append(f'{self._driving[0]} was not recorded: the loop of the controller stayed '
                        'open, and the recorded command drove the twin as in measured_input')
        if self._missing:
            bridged = sum(line.twin.bridged for line in self._lines)
            said.append(f'{self._missing} samples are missing; {bridged} were bridged')
        return tuple(said)

    def _take(self, recording: Recording) -> None:
        part = _Part(recording, recording.sequence - self._recording.sequence,
                     np.empty((len(PREDICTED), len(recording))),
                     np.empty((len(COMPARED) + len(BALANCES), len(recording))))
        self._parts.append(part)
        self._driven |= {name for name in self._driving
                         if name and not np.isnan(recording[name]).all()}
        present = self._present(recording)
        part.prediction[:, ~present] = part.residual[:, ~present] = np.nan
        self._missing += int((~present).sum())
        for begin, end in _stretches(present, [cut - part.begin for cut in self._cuts]):
            self._change(part.begin + begin)
            block = {name: column[begin:end] for name, column in recording.columns.items()}
            prediction, due = self._lines[-1].step(part.begin + begin, 0, samples_of(block))
            part.prediction[:, begin:end] = prediction.values.T
            self._fill(due)
        if not present[-1]:  # what follows does not continue it: nothing more is owed
            self._fill(self._lines[-1].finish())

    def _change(self, begin: int) -> None:
        """Do what changed before the sample at which the next step begins."""
        line = self._lines[-1]
        while self._changes and self._changes[0].sequence - self._recording.sequence <= begin:
            change = self._changes.popleft()
            if change.kind == BEGAN:
                self._fill(line.finish())
                line = _begun(change, self._servo, self._recording.period)
                self._lines.append(line)
            else:
                _change(line, change)

    def _fill(self, answers: list[Answer]) -> None:
        for one in answers:
            part = next(part for part in self._parts if one.sequence < part.end)
            at = one.sequence - part.begin
            part.residual[:, at:at + len(one.values)] = one.values.T

    def _complete(self) -> Iterator[tuple[Recording, Predictions]]:
        owed = self._lines[-1].owed
        while self._parts and (owed is None or self._parts[0].end <= owed):
            part = self._parts.popleft()
            recording, balances = part.recording, self._lines[-1].balances
            yield recording, Predictions(
                name=recording.name, period=recording.period,
                prediction=dict(zip(PREDICTED, part.prediction, strict=True)),
                residual=dict(zip(COMPARED + BALANCES, part.residual, strict=True)),
                channel_noise=balances.channel_noise, balance_noise=balances.noise,
                start=recording.start, sequence=recording.sequence, restarts=self.restarts)

    def _groups(self) -> tuple[tuple[str, ...], ...]:
        """Return columns of which a sample must have one, and those that the mode runs on."""
        return _MUST_ARRIVE if self._mode == 'closed_loop' else (*_MUST_ARRIVE, ('voltage',))

    def _present(self, recording: Recording) -> np.ndarray:
        present = np.ones(len(recording), dtype=bool)
        for group in self._groups():  # a drive that is off has no voltage
            known = np.zeros(len(recording), dtype=bool)
            for name in group:
                known |= ~np.isnan(recording[name])
                if known.all():
                    break
            if known.any():
                self._recorded.add(group)
            present &= known
        return present


def answer(recording: Long[Recording], servo: Servo, settings: Settings = _AS_DECLARED,
           changes: Sequence[Change] = ()) -> Predictions:
    """Return what a twin answers to a whole recording; see :class:`Answering`."""
    line = Answering(recording, servo, settings, changes)
    parts = [part for _, part in line]
    prediction, residual = (
        {name: np.concatenate([getattr(part, kind)[name] for part in parts])
         for name in getattr(parts[0], kind)} for kind in ('prediction', 'residual'))
    return replace(parts[-1], prediction=prediction, residual=residual, start=recording.start,
                   sequence=recording.sequence, warnings=line.warnings)


def _begun(change: Change, servo: Servo, period: float) -> Lockstep:
    fields = change.values
    text = fields.pop('servo_file')
    fields.pop(ZERO, None)
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


def _stretches(present: np.ndarray, cuts: Sequence[int]) -> list[tuple[int, int]]:
    """Return (begin, end) of what is stepped at once: nothing missing and no cut within."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], present.astype(np.int8), [0]))))
    found = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        marks = [int(begin), *sorted({cut for cut in cuts if begin < cut < end}), int(end)]
        found += [(at, min(last, at + _BLOCK)) for first, last in pairwise(marks)
                  for at in range(first, last, _BLOCK)]
    return found
