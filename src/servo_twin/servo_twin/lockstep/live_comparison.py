"""A replay held against its live run: what the live twin had seen, and where the bits differ."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..balances.residual_filters import half_of, WINDOW
from ..physics.servo import ServoError
from ..recording.events import BEGAN, Change
from ..recording.parts import Long, LongRecording, parts_of, SAMPLES
from ..recording.recording import BALANCES, Predictions, Recording


class Seen:
    """
    The samples of a recording that the live twin had seen when it was last heard.

    It begins where the twin did, as ``changes`` say, though the recorder may have heard it later;
    so it is wherever a twin began again. Other samples without an answer were left out, because
    the twin was behind: they are NaN. Residuals come half a ``window``, s, late: the last one that
    is no NaN saw so much more. Where the recorder did not hear that much of the rig, as it ended,
    ``balanced`` is the first sample whose balances no replay can know; else None.
    """

    def __init__(self, recording: LongRecording, live: Long[Predictions],
                 changes: Sequence[Change] = (), window: float = WINDOW) -> None:
        self._recording, self._live = recording, live
        end = live.sequence + len(live)
        half = half_of(window, live.period)
        last = live.part(end - half, end)
        known = np.flatnonzero(np.any([np.isfinite(last.residual[name]) for name in BALANCES], 0))
        seen = last.sequence + int(known[-1]) + 1 + half if len(known) else end
        begun = [one.sequence for one in changes if one.kind == BEGAN
                 and recording.sequence <= one.sequence <= live.sequence]
        whole = recording.sequence + len(recording)
        self.sequence = min(max(recording.sequence, max(begun, default=live.sequence)), whole)
        self._end = max(self.sequence, min(max(end, seen), whole))
        self.balanced = whole - half if seen > whole else None
        self._unheard = [(one.sequence, _first_heard(live, one.sequence)) for one in changes
                         if one.kind == BEGAN]
        head = recording.part(self.sequence, self.sequence)
        self.name, self.period, self.start = head.name, head.period, head.start
        self.servo, self.servo_file, self.family = head.servo, head.servo_file, head.family

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be said of the whole recording."""
        return self._recording.warnings

    def __len__(self) -> int:
        return self._end - self.sequence

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the end of the last one."""
        return len(self) * self.period

    def part(self, first: int, end: int) -> Recording:
        """Return the samples numbered from ``first`` to ``end``, as far as there are."""
        seen = self._recording.part(max(first, self.sequence), min(end, self._end))
        live = self._live.part(seen.sequence, seen.sequence + len(seen))
        unanswered = np.isnan(live.prediction['voltage'])
        for begun, heard in self._unheard:
            unanswered[max(0, begun - live.sequence):max(0, heard - live.sequence)] = False
        at = live.sequence - seen.sequence + np.flatnonzero(unanswered)
        for name in seen.columns if len(at) else ():
            seen.columns[name] = seen.columns[name].copy()
            seen.columns[name][at] = np.nan
        return seen


def _first_heard(live: Long[Predictions], begun: int) -> int:
    """Return the running number of the first answer that was recorded of a twin."""
    end = live.sequence + len(live)
    for first in range(max(begun, live.sequence), end, SAMPLES):
        answered = ~np.isnan(live.part(first, first + SAMPLES).prediction['voltage'])
        if answered.any():
            return first + int(answered.argmax())
    return end


def began_before(recording: LongRecording, changes: Sequence[Change]) -> int:
    """Return how many samples before a recording its live twin began, as far as that is known."""
    begun = [one.sequence for one in changes if one.kind == BEGAN]
    return max(0, recording.sequence - begun[0]) if begun else 0


class Differences:
    """
    Counts the samples of each channel and balance that differ in any bit, where both answer.

    Only samples that the live twin answered count, and residuals that it published: the last half
    window of one that was killed never was. Balances count to sample ``balanced``, if given: see
    :class:`Seen`. NaN equals NaN.
    """

    def __init__(self, live: Long[Predictions], balanced: int | None = None) -> None:
        self._live, self._balanced = live, balanced
        self._found: dict[str, int] = {}

    def add(self, again: Predictions) -> None:
        """Take in a part of the replay."""
        live = self._live.part(again.sequence, again.sequence + len(again))
        if not len(live):
            return
        again = again.part(live.sequence, live.sequence + len(live))
        told = {'prediction': ~np.isnan(live.prediction['voltage']),
                'residual': np.any([~np.isnan(one) for one in live.residual.values()], axis=0)}
        for kind, heard in told.items():
            for name, one in getattr(live, kind).items():
                other = getattr(again, kind)[name]
                same = (one == other) | (np.isnan(one) & np.isnan(other))
                if self._balanced is not None and kind == 'residual' and name in BALANCES:
                    same[max(0, self._balanced - live.sequence):] = True
                key = f'{kind} {name}'
                self._found[key] = self._found.get(key, 0) + int((heard & ~same).sum())

    @property
    def found(self) -> dict[str, int]:
        """Counts by channel; raises ServoError when the two share no sample."""
        if not self._found:
            end = self._live.sequence + len(self._live)
            raise ServoError(f'{self._live.name}: the live twin answered samples '
                             f'{self._live.sequence} to {end - 1}, the replay others')
        return self._found


def differences(live: Long[Predictions], again: Long[Predictions]) -> dict[str, int]:
    """Count where a whole replay differs from its live run; see :class:`Differences`."""
    counted = Differences(live)
    for part in parts_of(again):
        counted.add(part)
    return counted.found
