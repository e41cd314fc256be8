"""Whether the samples of a bag carry the numbers of the SYNCs that they answer, by the bus."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from wire_proxy import ANSWER

from servo_rig_driver.devices.pdo_table import SYNC_COUNTS

EARLY, LATE = 2e-3, 3.0  # s around its due instant in which a loaded machine answers a SYNC
RUN = 20  # samples in a row of a wrong number that are no chance
SURE = 0.9  # share of them that another number explains
FURTHEST = SYNC_COUNTS // 2  # SYNCs by which a number may be wrong


class Answers:
    """
    What the load encoder answered, as the witness on the driver's bus saw it.

    ``at`` (s), ``count`` (that the SYNC carried) and ``angle`` (rad) have the shape (answers,).
    """

    def __init__(self, at: np.ndarray, count: np.ndarray, angle: np.ndarray) -> None:
        order = np.lexsort((at, count))
        self._at, self._angle = at[order], angle[order].astype(np.float32)
        self._from = np.searchsorted(count[order], np.arange(SYNC_COUNTS + 2))

    @classmethod
    def read(cls, path: Path) -> Answers:
        """Return what a proxy has written."""
        data = path.read_bytes() if path.exists() else b''
        whole = len(data) // ANSWER.size * ANSWER.size
        told = np.frombuffer(data[:whole], [('at', '<f8'), ('count', 'u1'), ('angle', '<f4')])
        return cls(told['at'], told['count'], told['angle'])

    def hold(self, count: np.ndarray, due: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Return which angles were answers to SYNCs of these counts, due at these instants."""
        angle, found = angle.astype(np.float32), np.zeros(len(count), dtype=bool)
        for one in np.unique(count):
            those = np.flatnonzero(count == one)
            at = self._at[self._from[one]:self._from[one + 1]]
            told = self._angle[self._from[one]:self._from[one + 1]]
            first = np.searchsorted(at, due[those] - EARLY)
            last = np.searchsorted(at, due[those] + LATE)
            for step in range(int((last - first).max())):
                place = np.minimum(first + step, len(at) - 1)
                found[those] |= (first + step < last) & (told[place] == angle[those])
        return found

    def misnumbered(self, sequence: np.ndarray, due: np.ndarray, angle: np.ndarray) -> list[str]:
        """
        Return where samples answer other SYNCs than their numbers say.

        A driver that loses samples and counts on gives the numbers of those to later ones. When
        a message comes says nothing of that: a machine with other work holds up each part of the
        way. A stretch counts where RUN samples of a moving shaft all answer SYNCs that are as
        many numbers away; where the witness heard nothing, nothing is said.
        """
        count = 1 + (sequence % SYNC_COUNTS)
        wrong = np.concatenate([[False], ~self.hold(count, due, angle), [False]])
        edges = np.flatnonzero(np.diff(wrong))
        found = []
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            part = slice(begin, end)
            if end - begin < RUN or len(np.unique(angle[part])) < 0.5 * (end - begin):
                continue
            for by in sorted(range(-FURTHEST, FURTHEST), key=abs):
                other = 1 + (sequence[part] + by) % SYNC_COUNTS
                if by and self.hold(other, due[part], angle[part]).mean() > SURE:
                    found.append(f'{end - begin} samples from {due[begin]:.2f} s on answer the '
                                 f'SYNC {abs(by)} {"after" if by > 0 else "before"} their own')
                    break
        return found
