"""Twin and balances as one: samples in, predictions at once and residuals when they are due."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..balances.residual_filters import Balances, channel_residuals, WINDOW
from ..physics.servo import Servo, Value
from ..recording.joined_samples import CHANNELS
from ..recording.recording import BALANCES
from .encoder_screen import EncoderScreen
from .twin import Twin


@dataclass(frozen=True)
class Answer:
    """
    What a block of samples is answered with.

    ``values`` has shape (n, len(PREDICTED)), or (n, len(COMPARED) + len(BALANCES)) of a residual;
    ``stamp`` is the instant of the block's first sample in ns, ``sequence`` its running number.
    """

    sequence: int
    stamp: int
    values: np.ndarray


@dataclass(frozen=True)
class Settings:
    """How a twin runs: its mode, samples bridged, catching up and filter length (both in s)."""

    mode: str = 'measured_input'
    bridge: int = 50
    catch: float = 0.1
    window: float = WINDOW


class Lockstep:
    """
    Runs a servo beside a rig whose samples come every ``period`` s.

    Raises ServoError where the servo cannot run as the settings say.
    """

    def __init__(self, servo: Servo, period: float, settings: Settings) -> None:
        self.twin = Twin(servo, period, settings.mode, settings.bridge, settings.catch)
        self.balances = Balances(servo, period, settings.window)
        self.screen = EncoderScreen(servo, period)
        self._owed: deque[Answer] = deque()
        self._ready = np.empty((0, len(BALANCES)))

    def step(self, sequence: int, stamp: int, samples: np.ndarray) -> tuple[Answer, list[Answer]]:
        """
        Answer a block of samples, shape (n, len(CHANNELS)).

        An angle that no shaft can have is not measured (encoder_screen.py). Returns its
        prediction, and the residuals of all blocks whose balances are complete by now,
        oldest first: half a window after the block, for the balances look that far ahead.
        """
        samples, leaps = self._screened(sequence, samples)
        y = self.twin.step(sequence, samples, leaps)
        self._owed.append(Answer(sequence, stamp, channel_residuals(samples, y)))
        self._gather(self.balances.push(samples, y, self.twin.breaks))
        return Answer(sequence, stamp, y), self._due()

    def _screened(self, sequence: int, samples: np.ndarray) -> tuple[np.ndarray, dict[int, str]]:
        expected = self.twin.next
        missing = 0 if expected is None else sequence - expected
        if 0 <= missing <= self.twin.bridge:
            self.screen.missed(missing)
        else:
            self.screen.begin()
        return self.screen.take(samples)

    @property
    def owed(self) -> int | None:
        """Running number of the first sample whose residual is not complete; None: of none."""
        return self._owed[0].sequence if self._owed else None

    def finish(self) -> list[Answer]:
        """Return the residuals still owed, whose last half window of balances is NaN."""
        self._gather(self.balances.finish())
        return self._due()

    def set(self, changes: Mapping[str, Value], source: str | None = None) -> None:
        """Change values by path from the next sample on; see Twin.set."""
        self.twin.set(changes, source)
        self.screen.follow(self.twin.servo)
        self.balances.retune(self.twin.servo, self.twin.period)

    def follow(self, settings: Settings) -> None:
        """Run as other settings say from the next sample on; the window stays."""
        if settings.mode != self.twin.mode:
            self.twin.mode = settings.mode
        self.twin.bridge, self.twin.catch = settings.bridge, settings.catch

    def load(self, servo: Servo) -> bool:
        """Run another servo from the next sample on; see Twin.load."""
        kept = self.twin.load(servo)
        self.screen.follow(servo)
        self.balances.retune(servo, self.twin.period)
        return kept

    def _gather(self, rows: np.ndarray) -> None:
        self._ready = np.vstack([self._ready, rows]) if len(self._ready) else rows

    def _due(self) -> list[Answer]:
        due, used = [], 0
        while self._owed and used + len(self._owed[0].values) <= len(self._ready):
            owed = self._owed.popleft()
            rows = self._ready[used:used + len(owed.values)]
            due.append(Answer(owed.sequence, owed.stamp, np.hstack([owed.values, rows])))
            used += len(rows)
        self._ready = self._ready[used:]
        return due


def warm_up(servo: Servo) -> None:
    """Compile all that running this servo calls, so that no sample waits for it later."""
    line = Lockstep(servo, servo.step, Settings(window=0.0, catch=0.0))
    for sequence in range(2 * line.balances.half + 1):
        line.step(sequence, 0, np.zeros((1, len(CHANNELS))))
