r"""
In which place a change is: a Bayesian comparison of what may have changed.

:mod:`.equation_changes` says what a change of each place adds to the equations of the servo.
Blocks of each equation are whitened by what is usual (:mod:`.residual_process`, learned while
nothing changed), which includes that any term of an equation may be off by a share. The whitened
blocks :math:`w` of all equations since the change are then compared under each candidate:

.. math:: w \sim N(0,\; I + a^2 (S S^T + \varepsilon^2 \mathrm{diag}(S S^T)))

:math:`S` is the whitened shape of the candidate, which sets in at once or rises from then on. The
second term is the model's own error: the rig's law is like the candidate's shape only to one of
:data:`MISFITS`. The size :math:`a` is not known, each decade alike. All places are alike before,
and so are the candidates of one place. The answer is the probability of each place. Places that
the channels cannot tell apart, such as friction of motor and load without a torque sensor, share
it: :attr:`Located.places` names all that are needed for :data:`SURE`.

Source: MacKay: Information Theory, Inference, and Learning Algorithms, 2003, chapter 28.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, eigh, solve_triangular
from scipy.special import logsumexp

from servo_twin.physics.servo import Servo

from .change_candidates import Candidate
from .change_detector import ONE_THREAD
from .change_evidence import likelihood, onset_of, solved
from .equation_changes import Equations
from .residual_process import ResidualProcess

MISFITS, OF_SENSORS = (0.02, 0.2), (0.02,)
"""By how much, as a share, a true change may differ in shape from a candidate of the rig's parts,
each alike, and from an error of a reading, which has no law of its own."""

SURE = 0.95
"""Probability that the places which are named hold the change."""

AFTER = 8.0
"""Seconds from an alarm until its place is asked for."""

BEFORE = 40
"""Blocks before the window of the alarm in which a change may have begun, slowly."""

_REACH = 0.03  # rad over which a curve over the load's angle is alike
_CURVE = 60  # shapes of such a curve at most
_CERTAIN = 1e30  # logarithm of the likelihood of what nothing else does
_LEAST = 8  # blocks by which a reading that repeats itself is stuck


@dataclass(frozen=True)
class Located:
    """Probabilities of the places, and the candidate that is the likeliest of each."""

    probability: dict[str, float]
    likeliest: dict[str, str]

    @property
    def places(self) -> tuple[str, ...]:
        """The likeliest places that together have the probability SURE."""
        order = sorted(self.probability, key=lambda name: -self.probability[name])
        sums = np.cumsum([self.probability[name] for name in order])
        return tuple(order[:int(np.searchsorted(sums, SURE)) + 1])

    def __str__(self) -> str:
        return ' or '.join(f'{name} ({self.likeliest[name]}, {100 * self.probability[name]:.0f} %)'
                           for name in self.places)


class ChangePlace:
    """
    Keeps blocks of a servo's equations, and says where a change is.

    ``push`` takes samples with ``half`` more on both sides; ``locate`` may be called after an
    alarm, whose window began at ``since``.
    """

    def __init__(self, servo: Servo, period: float, block: float, learn: float) -> None:
        self.equations = Equations(servo, period)
        self.half = self.equations.half
        self.size = max(8, round(block / period))
        self._learn = round(learn / period / self.size)
        self.relearn()

    def relearn(self) -> None:
        """Forget everything and learn what is usual again."""
        self._blocks: list[tuple[int, np.ndarray]] = []
        self._held = np.empty((0, 0))
        self._next: int | None = None
        self._known: list[ResidualProcess] = []

    def push(self, sequence: int, rows: np.ndarray) -> None:
        """Take samples (n + 2 half, len(CHANNELS)), of which the n in the middle are new."""
        signals = self.equations.signals(rows)
        if sequence != self._next or not len(self._held):
            self._held = signals[:0]
        self._next = sequence + len(signals)
        self._held = np.vstack([self._held, signals])
        while len(self._held) >= self.size:
            self._blocks.append((self._next - len(self._held) + self.size,
                                 self._held[:self.size].mean(axis=0)))
            self._held = self._held[self.size:]
        del self._blocks[self._learn:-(BEFORE + 3 * self._learn)]

    def locate(self, since: int, end: int | None = None) -> Located | None:
        """
        Return where a change is whose alarm tells of samples from ``since`` on; None: not known.

        Blocks count up to the sample ``end``, all of them without it. Takes seconds.
        """
        with ONE_THREAD.limit(limits=1, user_api='blas'):
            try:
                return self._locate(since, end)
            except np.linalg.LinAlgError:  # what is usual repeats itself to the last bit
                return None

    def _locate(self, since: int, end: int | None) -> Located | None:
        kept = list(self._blocks)  # samples may come meanwhile
        ends = np.array([at for at, _ in kept])
        blocks = np.array([one for _, one in kept])
        good = np.isfinite(blocks).all(axis=1) if len(blocks) else np.zeros(0, dtype=bool)
        learned = np.flatnonzero(good[:self._learn])
        begin = int(np.searchsorted(ends - self.size, since))
        window = np.arange(max(self._learn, begin - BEFORE),
                           len(ends) if end is None else int(np.searchsorted(ends, end, 'right')))
        window = window[good[window]]
        if not self.equations.names or len(learned) < 30 or len(window) < 8:
            return None
        blocks = self.equations.with_flanks(blocks, blocks[learned])
        time = ends / self.size
        white, _ = self._whitened(blocks, time, learned, window)
        onset = onset_of(white)
        begin = int(window[onset])
        window = np.delete(window, [k for k in (onset - 1, onset) if k >= 0])
        white, roots = self._whitened(blocks, time, learned, window)
        evidence = self._evidence(blocks, time, window, begin, white, roots)
        found: dict[str, list[tuple[float, str]]] = {}
        for candidate, value in evidence:
            found.setdefault(candidate.place, []).append((value, candidate.name))
        each = {place: float(logsumexp([value for value, _ in those])) - np.log(len(those))
                for place, those in found.items()}
        whole = float(logsumexp(list(each.values())))
        return Located({place: float(np.exp(value - whole)) for place, value in each.items()},
                       {place: max(those)[1] for place, those in found.items()})

    def _whitened(self, blocks: np.ndarray, time: np.ndarray, learned: np.ndarray,
                  window: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        """
        Return the whitened equations, (n, e), and the root that whitens each, over its unit.

        What is usual of each equation is filled into the blocks.
        """
        covariates = self.equations.covariates(blocks)
        basis = np.hstack([np.ones((len(blocks), 1)), covariates, np.abs(covariates)])
        white, roots = [], []
        for q, terms in enumerate(self.equations.terms):
            own = [size * blocks[:, signal] for signal, size, _ in terms]
            whole = np.column_stack([basis, *own])
            if len(self._known) <= q:
                self._known.append(ResidualProcess(
                    blocks[learned, q], whole[learned], time[learned], [0, 1, 2], len(own)))
            process = self._known[q]
            rows = whole[window] / process.scale
            left, known = process.unforeseen(blocks[window, q], rows, time[window])
            usual = self.equations.index(f'usual {self.equations.names[q]}')
            blocks[window, usual] = blocks[window, q] - left * process.spread
            covariance = process.covariance(rows, time[window], rows, time[window])
            drift = rows[:, basis.shape[1]:] * [drift / size if size else 0.0
                                                for _, size, drift in terms]
            covariance += drift @ drift.T + np.diag(1e-9 + np.square(drift).sum(axis=1))
            root = cholesky(covariance - known @ known.T, lower=True)
            white.append(solve_triangular(root, left, lower=True))
            roots.append(root * process.spread)
        return np.array(white).T, roots

    def _evidence(self, blocks: np.ndarray, time: np.ndarray, window: np.ndarray, begin: int,
                  white: np.ndarray, roots: list[np.ndarray]
                  ) -> Iterator[tuple[Candidate, float]]:
        """Yield each candidate and the logarithm of its likelihood."""
        courses = []
        for start in {begin, max(int(window[0]), begin - BEFORE // 2)}:
            after = np.maximum(0.0, time[window] - time[start] + 0.5)
            courses += [(after > 0.0) + 0.0, after / after.max()] if after.any() else []
        for candidate in self.equations.candidates:
            if candidate.stuck >= 0:
                if self._repeats(blocks[window], candidate.stuck):
                    yield candidate, _CERTAIN
                continue
            columns = self._columns(candidate, blocks[window], roots)
            misfits = OF_SENSORS if candidate.place == 'sensor' else MISFITS
            told = []
            for course in courses:
                shapes = [solved(roots, column * course[:, None]) for column in columns]
                told += [likelihood(white, shapes, misfit, candidate.as_one
                                    or candidate.by_angle >= 0) for misfit in misfits]
            yield candidate, float(logsumexp(told)) - np.log(len(told))

    def _columns(self, candidate: Candidate, blocks: np.ndarray, roots: list[np.ndarray]
                 ) -> list[np.ndarray]:
        """Return what a candidate adds to the equations, (n, e) each."""
        found = []
        if candidate.by_angle >= 0:
            angle = blocks[:, self.equations.index('angle')]
            alike = np.exp(-0.5 * np.square((angle[:, None] - angle) / _REACH))
            sizes, curves = eigh(alike)
            for size, curve in list(zip(sizes, curves.T, strict=True))[-_CURVE:]:
                column = np.zeros((len(blocks), len(roots)))
                column[:, candidate.by_angle] = np.sqrt(max(size, 0.0)) * curve
                found.append(column)
        for shape in candidate.shapes:
            column = np.zeros((len(blocks), len(roots)))
            for equation, signal, factor in shape:
                column[:, equation] += factor * blocks[:, signal]
            found.append(column)
        return found

    def _repeats(self, blocks: np.ndarray, channel: int) -> bool:
        """Whether a reading has not changed in any sample of the last blocks, moving."""
        last = blocks[-_LEAST:]
        moves = np.abs(last[:, self.equations.index('direction')]).mean() > 0.2
        return bool(len(last) == _LEAST and moves
                    and not last[:, self.equations.index(f'moving {channel}')].any())
