r"""
A change detector for the balances, with a stated rate of false alarms.

The residual of a balance is cut into blocks. While learning, what it owes to how the rig is driven
(an imperfect twin has a residual of its own) is regressed on the covariates and their sizes. A
block then counts by its mean and by the cube root of the mean square of what remains, which is
nearly normal where the mean square is not (Wilson, Hilferty 1931). That needs some degrees of
freedom a block, :math:`2\,\mathrm{mean}^2/\mathrm{var}` of the mean squares; where there are too
few, several blocks count as one. Both are whitened by an autoregression, and so are the
regressors :math:`g`. Afterwards the innovations :math:`e` of the last :math:`L` blocks are
matched with each regressor whose share may have changed: the constant, and each covariate (more
friction is a residual that turns with the direction),

.. math:: z = \frac{\sum g_q e}{s\sqrt{P_{qq} + P_q^T M^{-1} P_q}}, \quad P = \sum g g^T

over the window, :math:`M` the same sum over learning: the generalised likelihood ratio of a change
within the last L blocks, with what learning left uncertain. :math:`P_{qq}` is widened where
windows of learning spread more than white innovations would. The threshold is the union bound. A
window of L blocks is judged every L/2 blocks. Judging all windows of all regressors at
:math:`P(|t_\nu| > h_L)` gives at most the stated rate of false alarms, if innovations are normal,
with Student's t for the :math:`\nu` degrees of freedom that learning left. Innovations are cut at
:data:`.chart.MOST` deviations first, so that one wild block is not taken for a change.

It says nothing of a rig that is driven beyond what was seen while learning: such blocks are
passed over. A slow drift is followed by nothing here and is found in the end.

Sources: Basseville, Nikiforov: Detection of Abrupt Changes, 1993, sections 2.4 and 8.2; Lai:
Sequential changepoint detection in quality control, JRSS B 57 (1995), for windows on a grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .control_chart import Chart

FREEDOM = 8.0
"""Degrees of freedom that a mean square has at least."""

LEAST = 24
"""Blocks that learning holds at least, where several count as one."""

BEYOND = 0.1
"""How far a covariate may leave what was learned, as a share of its largest size there."""

FEATURES = ('mean', 'power')


@dataclass(frozen=True)
class Alarm:
    """
    A change: of which balance, in which of FEATURES, by how many deviations, seen when.

    ``since`` is the running number of the first sample of the window that told, ``sequence`` that
    of its end.
    """

    balance: str
    feature: str
    deviations: float
    since: int
    sequence: int


@dataclass(frozen=True)
class Settings:
    """
    How to watch.

    ``block`` and ``learn`` in s; ``false_alarms`` an hour, of all balances together. ``least``:
    a change that adds less than so many noise floors is of no interest.
    """

    block: float = 0.25
    learn: float = 60.0
    false_alarms: float = 0.1
    least: float = 3.0

    def __post_init__(self) -> None:
        for name, value in (('block', self.block), ('false_alarms', self.false_alarms)):
            if not value > 0.0:
                raise ValueError(f'{name} = {value:g}; it must be positive')
        if self.learn < 30 * self.block:
            raise ValueError(f'learn = {self.learn:g} s holds fewer than 30 blocks of '
                             f'{self.block:g} s')


class ChangeDetector:
    """
    Watches balances, by name, whose residuals come sample by sample.

    ``push`` takes blocks of any size and returns what has just been found; an alarm stands in
    ``alarms``, and its balance is not judged again, until ``relearn``. ``state`` says 'learning'
    or 'watching' and ``passed_over`` how many blocks were not judged.
    """

    def __init__(self, balances: Sequence[str], period: float,
                 settings: Settings = Settings()) -> None:
        self.balances = tuple(balances)
        self.settings = settings
        self.period = period
        self.size = max(8, round(settings.block / period))
        self.relearn()

    def relearn(self) -> None:
        """Forget everything and learn what is usual again."""
        self.alarms: dict[str, Alarm] = {}
        self.passed_over = 0
        self._learned: list[tuple[np.ndarray, np.ndarray]] = []
        self._charts: dict[int, tuple[Chart, ...]] = {}
        self._held: list[np.ndarray] = []
        self._count = 0
        self._next: int | None = None
        self._low: np.ndarray | None = None
        self._high: np.ndarray | None = None

    @property
    def state(self) -> str:
        """What it does: 'learning' or 'watching'."""
        return 'learning' if self._low is None else 'watching'

    @property
    def learned(self) -> float:
        """How much of the learning is done, 0 to 1."""
        needed = self.settings.learn / (self.size * self.period)
        return 1.0 if self._low is not None else min(1.0, len(self._learned) / needed)

    def push(self, sequence: int, residuals: np.ndarray,
             covariates: np.ndarray | None = None) -> list[Alarm]:
        """
        Take residuals (n, balances), in noise floors, of samples from number ``sequence`` on.

        ``covariates`` (n, m): how the rig is driven (speed, torque ...), any unit. NaN: not
        known; a balance that is never known is not watched. Samples that are missing begin a
        block again.
        """
        if self._next is not None and sequence != self._next:
            self._held.clear()
            self._count = 0
        self._next = sequence + len(residuals)
        if covariates is None:
            covariates = np.empty((len(residuals), 0))
        self._held.append(np.hstack([residuals, covariates]))
        self._count += len(residuals)
        if self._count < self.size:
            return []
        rows = np.vstack(self._held)
        whole = len(rows) // self.size * self.size
        self._held = [rows[whole:]]
        self._count = len(rows) - whole
        found = []
        for start in range(0, whole, self.size):
            end = self._next - len(rows) + start + self.size
            found += self._take(end, rows[start:start + self.size])
        return found

    def _take(self, end: int, rows: np.ndarray) -> list[Alarm]:
        count = len(self.balances)
        driven = _basis(rows[:, count:])
        covariates = driven.mean(axis=0)
        if self._low is None:
            if np.isfinite(covariates).all():
                self._learned.append((rows[:, :count], driven))
            if len(self._learned) * self.size * self.period >= self.settings.learn:
                self._conclude()
            return []
        if not ((covariates >= self._low) & (covariates <= self._high)).all():
            self.passed_over += 1
            for pair in self._charts.values():
                for chart in pair:
                    chart.interrupt()
            return []
        found = []
        for column, charts in self._charts.items():
            if self.balances[column] in self.alarms:
                continue
            values = _features(rows[:, column], driven, charts[0].slopes)
            told = [(chart.take(value, covariates), feature) for chart, value, feature in zip(
                charts, values, FEATURES, strict=False)]
            (deviations, window), feature = max(told, key=lambda one: abs(one[0][0]))
            if window:
                found.append(Alarm(self.balances[column], feature, deviations,
                                   end - window * self.size, end))
        self.alarms |= {alarm.balance: alarm for alarm in found}
        return sorted(found, key=lambda alarm: -abs(alarm.deviations))

    def _conclude(self) -> None:
        """Make the charts of what was learned."""
        rows = np.array([r for r, _ in self._learned])
        driven = np.array([d for _, d in self._learned])
        covariates = driven.mean(axis=1)
        margin = BEYOND * np.abs(covariates).max(axis=0) + 1e-12
        self._low, self._high = covariates.min(axis=0) - margin, covariates.max(axis=0) + margin
        means = rows.mean(axis=1)
        watched = [column for column in range(len(self.balances))
                   if np.isfinite(means[:, column]).mean() > 0.9
                   and np.nanstd(means[:, column]) > 0.0]
        block = self.size * self.period
        # What may change: the constant and the covariates, as far as they were there at all.
        matched = [k for k in range(1 + covariates.shape[1] // 2)
                   if np.abs(covariates[:, k]).max() > 0.0]
        rate = (self.settings.false_alarms / 3600.0 * block
                / max(1, len(watched) * (len(matched) + 1)))
        for column in watched:
            mean = Chart(means[:, column], covariates, rate, matched, least=self.settings.least)
            powers = np.array([_features(r[:, column], d, mean.slopes)[1]
                               for r, d in zip(rows, driven, strict=True)])
            every = _together(powers)
            usual = float(np.nanmean(powers))
            least = np.cbrt(usual + self.settings.least ** 2) - np.cbrt(usual)
            self._charts[column] = (mean,) if not every else (
                mean, Chart(powers, covariates, rate * every, [0], every, 1.0 / 3.0, float(least)))
        self._learned.clear()


def _basis(covariates: np.ndarray) -> np.ndarray:
    """Return what a residual may depend on, shape (n, 1 + 2 m): one, covariates, their sizes."""
    return np.hstack([np.ones((len(covariates), 1)), covariates, np.abs(covariates)])


def _features(rows: np.ndarray, driven: np.ndarray, slopes: np.ndarray) -> tuple[float, float]:
    """Return the mean, and the mean square of what the slopes leave."""
    left = rows - driven @ slopes
    return float(rows.mean()), float(left @ left) / len(left)


def _together(powers: np.ndarray) -> int:
    """Return how many blocks count as one, so that a mean square is nearly normal; 0: too many."""
    powers = powers[np.isfinite(powers)]
    for every in (1, 2, 4, 8, 16):
        whole = len(powers) // every
        if whole < LEAST:
            break
        joined = powers[:whole * every].reshape(whole, every).mean(axis=1)
        if 2.0 * joined.mean() ** 2 >= FREEDOM * joined.var():
            return every
    return 0
