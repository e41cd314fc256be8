"""Which servo file the twin runs, which it ran before, and whether the new one is better."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Trial:
    """A new servo file on trial: both texts, and the sample from which it is judged."""

    old: str
    new: str
    since: int


class Models:
    """
    The servo files of one twin, as YAML texts.

    ``margin``: how much worse, as a share, the new one may be and yet stay. ``sentence`` says
    what happened last, for people.
    """

    def __init__(self, running: str, margin: float) -> None:
        self.running = running
        self.margin = margin
        self.previous = ''
        self.trial: Trial | None = None
        self.loads = self.returns = 0
        self.sentence = 'the twin runs the servo file that it began with'

    def loaded(self, new: str, old: str, since: int) -> None:
        """Note that the twin runs a new file in place of the old, from a sample on."""
        self.running, self.previous = new, old
        self.trial = Trial(old, new, since)
        self.loads += 1
        self.sentence = 'a new servo file is on trial'

    def returned(self, why: str) -> None:
        """Note that the twin runs the old file again."""
        self.running, self.previous = self.previous, self.running
        self.trial = None
        self.returns += 1
        self.sentence = f'went back to the servo file before: {why}'

    def judged(self, old: float, new: float, balances: Mapping[str, tuple[float, float]],
               seconds: float) -> bool:
        """
        Take a judgement, root mean squares in noise floors; return whether to go back.

        The trial is over in either case.
        """
        self.trial = None
        worst = max(balances, key=lambda name: balances[name][1] - balances[name][0])
        said = (f'residuals over the last {seconds:.0f} s: {new:.3g} noise floors with the new '
                f'servo file, {old:.3g} with the old')
        if new > old * (1.0 + self.margin):
            self.sentence = f'{said}; worst is {worst}'
            return True
        self.sentence = f'the new servo file stays: {said}'
        return False

    def given_up(self, why: str) -> None:
        """Note that the new file could not be judged; it stays."""
        self.trial = None
        self.sentence = f'the new servo file stays, unjudged: {why}'
