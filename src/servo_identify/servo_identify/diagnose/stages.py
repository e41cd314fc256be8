"""The stages of a diagnosis: which one it is at, and how long each took."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import time

STAGES = ('reading', 'check', 'residuals', 'selection', 'confidence', 'stability', 'refit',
          'comparison', 'next experiment')


@dataclass
class Stages:
    """
    Tells and times the stages of one diagnosis.

    ``tick(stage, share)`` is told where it is; ``seconds`` is what each stage took so far.
    """

    tick: Callable[[str, float], None]
    seconds: dict[str, float] = field(default_factory=dict)
    _stage: str = ''
    _since: float = 0.0

    def begin(self, stage: str) -> None:
        """End the stage that was and begin another, or the same one once more."""
        self.end()
        self._stage, self._since = stage, time.perf_counter()
        self.tick(stage, 0.0)

    def share(self, done: float) -> None:
        """Tell how much of the stage is done, 0 to 1."""
        self.tick(self._stage, done)

    def end(self) -> None:
        """End the stage that was."""
        if self._stage:
            spent = self.seconds.get(self._stage, 0.0) + time.perf_counter() - self._since
            self.seconds[self._stage] = round(spent, 3)
        self._stage = ''
