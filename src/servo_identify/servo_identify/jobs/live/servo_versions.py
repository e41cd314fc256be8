"""Which servo file the twin runs, which it ran before, and whether the new one is better."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from threading import RLock

from .told_servo import running_after, same


@dataclass(frozen=True)
class Trial:
    """A new servo file on trial: both texts, and the sample from which it is judged."""

    old: str
    new: str
    since: int


class Models:
    """
    The servo files of one twin, as YAML texts; may be told of by several threads.

    ``margin``: how much worse, as a share, the new one may be and yet stay. ``sentence`` says
    what happened last, for people.

    A file that is loaded from here is told of twice, in either order: the twin answers, and
    says so to all. So say :meth:`asks` first, by which its word is known as the own file's.
    """

    def __init__(self, running: str, margin: float) -> None:
        self.running = running
        self.margin = margin
        self.previous = ''
        self.trial: Trial | None = None
        self.loads = self.returns = 0
        self.sentence = 'the twin runs the servo file that it began with'
        self._told = False  # whether the twin runs what stands here is only supposed until then
        self._asked, self._came = '', False
        self._lock = RLock()

    def asks(self, text: str) -> None:
        """Note that the twin is asked to run a file; empty: that it does not."""
        with self._lock:
            self._asked, self._came = text, False

    def follows(self, kind: str, content: str) -> bool:
        """
        Take over what the twin says that it runs; return whether that is new and not from here.

        ``kind`` and ``content`` are those of Event.msg. What others change ends a trial. Raises
        ValueError as :func:`running_after` does.
        """
        with self._lock:
            first, self._told = not self._told, True
            then = running_after(self.running, kind, content)
            if self._asked and same(then, self._asked):
                self.running, self._came = self._asked, True
                return False
            if then == self.running:
                return False
            if not first:
                self.previous = self.running
            self.running, self.trial = then, None
            self.sentence = ('the twin runs a servo file, or values, that were not loaded from '
                             'here')
            return True

    def loaded(self, new: str, old: str, since: int) -> None:
        """Note that the twin runs a new file in place of the old, from a sample on."""
        with self._lock:
            self.loads += 1
            if self._stays(new, old):
                self.trial = Trial(old, new, since)
                self.sentence = 'a new servo file is on trial'

    def returned(self, now: str, before: str, why: str) -> None:
        """Note that the twin runs an old file again, in place of the one ``before``."""
        with self._lock:
            self.returns += 1
            if self._stays(now, before):
                self.trial = None
                self.sentence = f'went back to the servo file before: {why}'

    def _stays(self, now: str, before: str) -> bool:
        """Take over what the twin answered, unless others have changed it again since."""
        overtaken = self._came and self.running != now
        self._asked, self._came, self._told = '', False, True
        if not overtaken:
            self.running, self.previous = now, before
        return not overtaken

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
