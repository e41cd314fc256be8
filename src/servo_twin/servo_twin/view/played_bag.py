"""A bag as a source of the view: its samples, and what a twin answers, at the pace they came."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite
from pathlib import Path
from time import monotonic
from typing import Any

from ..bag import (
    BagError,
    open_predictions,
    open_recording,
    OpenRecording,
    read_changes,
    read_events,
)
from ..description.servo_file import dumps, load, loads
from ..lockstep.lockstep import warm_up
from ..lockstep.whole_recording import Answering
from ..physics.servo import Servo, ServoError
from ..recording.events import Happened
from ..recording.parts import parts_of
from ..recording.recording import Recording
from .shown_rows import ShownRows
from .source import EVENTS, Source
from .traces import NAMES


class PlayedBag(Source):
    """
    Plays a bag from its beginning once somebody looks.

    With ``servo`` a twin of that file answers; else what the bag holds of its live twin is shown,
    and where it holds none, a twin of the servo file in it answers. Raises BagError or ServoError.
    """

    kind = 'bag'

    def __init__(self, bag: Path, servo: Path | None = None, namespace: str | None = None) -> None:
        super().__init__()
        self._bag, self._namespace = bag, namespace
        self._events = read_events(bag, namespace)
        self._rows = ShownRows()
        with open_recording(bag, namespace) as whole:
            self._size, self._duration, self._first = len(whole), whole.duration, whole.sequence
            self._recording = whole.part(whole.sequence, whole.sequence)
            self._servo = _servo_of(self._recording, servo)
            self._warnings = [*self._answered(whole, servo), *whole.warnings]
        self._at = 0.0  # s of the recording up to which it is shown
        self._playing, self._looked, self._since = True, False, monotonic()
        self._shown = 0

    def _answered(self, whole: OpenRecording, servo: Path | None) -> list[str]:
        """Keep all that is shown, part by part; return what is to be said of the answers."""
        if servo is None:
            try:
                with open_predictions(self._bag, self._namespace) as live:
                    for part in parts_of(whole):
                        self._rows.add(part, live.part(part.sequence, part.sequence + len(part)))
                    return list(live.warnings)
            except BagError:
                self._rows.clear()  # recorded without its twin
        if self._servo is None:
            for part in parts_of(whole):
                self._rows.add(part, None)
            return ['no servo file is stored in the bag: --servo gives it a twin']
        warm_up(self._servo)
        changes = [] if servo else read_changes(self._bag, self._namespace, whole)
        twin = Answering(whole, self._servo, changes=changes)
        for part, answer in twin:
            self._rows.add(part, answer)
        return list(twin.warnings)

    def look(self, wanted: bool) -> None:
        """Go on, or stand still."""
        self._move()
        self._looked = wanted

    def advance(self) -> None:
        """Show what has been played since the last tick."""
        self._move()
        end = self._reached
        if end <= self._shown:
            return
        first = max(self._shown, end - round(self.traces.seconds / self._recording.period))
        rows = self._rows.part(first, end)
        period = self._recording.period
        self.traces.put('encoder', first, round((self._recording.start + first * period) * 1e9),
                        period, dict(zip(NAMES, rows, strict=True)))
        self._shown = end

    @property
    def _reached(self) -> int:
        """How many samples have been played."""
        return min(self._size, int(self._at / self._recording.period + 1e-9))

    def _move(self) -> None:
        now = monotonic()
        if self._playing and self._looked:
            self._at = min(self._at + now - self._since, self._duration)
        self._since = now

    def play(self, playing: bool | None, at: float | None) -> None:
        """Play or pause; going to a second shows what was before it."""
        self._move()
        if at is not None and isfinite(at):
            self._at = min(max(0.0, at), self._duration)
            self._shown = 0
            self.traces.clear()
        if playing is not None:
            self._playing = playing
            if playing and self._at >= self._duration:
                self.play(None, 0.0)

    def facts(self) -> dict[str, Any]:
        """Return title, position and the servo's values."""
        recording = self._recording
        playing = self._playing and self._at < self._duration
        told = {
            'status': {
                'title': recording.name, 'servo': recording.servo or 'no servo file',
                'said': 'playing a recording' if playing else 'paused', 'level': 0,
                'nodes': [], 'warnings': self._warnings},
            'played': {'at': round(self._at, 2), 'duration': self._duration,
                       'playing': playing}}
        if self._servo is not None:
            told['values'] = values_of(self._servo)
        return told

    def servo(self) -> Servo | None:
        """Return the servo of the twin."""
        return self._servo

    def events(self) -> list[Happened]:
        """Return what happened up to the second that is shown."""
        until = (self._recording.start + self._at) * 1e9
        return [one for one in self._events if one.stamp <= until][-EVENTS:]

    def recording(self, seconds: float) -> Recording:
        """Return the seconds before the one that is shown."""
        if self._servo is None:
            raise ServoError(f'{self._recording.name}: no servo file is stored in it; give one by '
                             '--servo')
        end = self._first + self._reached
        first = end - round(seconds / self._recording.period)
        with open_recording(self._bag, self._namespace) as whole:
            return replace(whole.part(first, end), servo=self._servo.name,
                           servo_file=dumps(self._servo))

    def close(self) -> None:
        """Give up what is kept."""
        self._rows.close()


def values_of(servo: Servo) -> list[dict[str, Any]]:
    """Return the numbers of a servo for the page: path, value, unit, bounds, meaning."""
    return [{'path': path, 'value': servo.values[path], 'unit': servo.unit(path),
             'low': declared.bounds[0], 'high': declared.bounds[1], 'meaning': declared.meaning}
            for path, declared in servo.declarations()
            if not isinstance(servo.values[path], tuple)]


def _servo_of(recording: Recording, given: Path | None) -> Servo | None:
    if given is not None:
        return load(given)
    if not recording.servo_file:
        return None
    return loads(recording.servo_file, f'servo file in {recording.name}', code=False)
