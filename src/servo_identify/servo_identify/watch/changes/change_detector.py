r"""
A change detector for the balances, with a stated rate of false alarms.

The residual of a balance is cut into blocks. Each block has two features: the mean of the
residual, and the logarithm of one and the variance of what a regression on the covariates leaves.
:mod:`.residual_process` learns what a feature does while nothing changes: how it follows the
motion, how it differs between moves and rests, how fast it wanders. :mod:`.control_chart` asks
whether the share of a regressor :math:`g` has changed within the last :math:`L` blocks. A
regressor is the constant or a covariate: more friction turns with the direction.

.. math:: z = \frac{h^T K^{-1} y}{\sqrt{h^T K^{-1} h}}

is the generalised likelihood ratio of such a change. :math:`h` is the regressor within the last L
blocks and zero before, :math:`K` the covariance of the blocks :math:`y` given learning. K holds
what learning left uncertain, and that blocks err alike. Innovations are cut at
:data:`.control_chart.MOST` deviations (Huber 1964): a change needs several that agree. The
threshold is the union bound. Judging all windows of all regressors at :math:`P(|t_\nu| > h_L)`
gives at most the stated rate of false alarms. Where windows of the healthy past spread more than
the process says, deviations are divided by that.

It says nothing of a rig that is driven beyond what was seen while learning: such blocks are
passed over. What changes no faster than it did while learning is no change.

Sources: Basseville, Nikiforov: Detection of Abrupt Changes, 1993, sections 2.4 and 7.2; Lai:
Sequential changepoint detection in quality control, JRSS B 57 (1995), for windows on a grid;
Huber: Robust estimation of a location parameter, Ann. Math. Stat. 35 (1964).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from threadpoolctl import ThreadpoolController

from .alarm import Alarm
from .control_chart import Chart

ONE_THREAD = ThreadpoolController()  # of linear algebra: several wait for each other most of all

BEYOND = 0.1
"""How far a covariate may leave what was learned, as a share of its largest size there."""

MAKING = 2
"""Blocks for which one chart is made, after learning: the samples must not wait for them."""

FEATURES = ('mean', 'power')


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
        self._learned_at: list[int] = []
        self._blocks = 0
        self._charts: dict[int, tuple[np.ndarray, list[Chart]]] = {}
        self._to_make: list[tuple[int, Callable[[], Chart]]] = []
        self._held: list[np.ndarray] = []
        self._count = 0
        self._next: int | None = None
        self._low: np.ndarray | None = None
        self._high: np.ndarray | None = None

    @property
    def state(self) -> str:
        """What it does: 'learning' or 'watching'."""
        return 'learning' if self._low is None or self._to_make else 'watching'

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
        with ONE_THREAD.limit(limits=1, user_api='blas'):
            for start in range(0, whole, self.size):
                end = self._next - len(rows) + start + self.size
                found += self._take(end, rows[start:start + self.size])
        return found

    def _take(self, end: int, rows: np.ndarray) -> list[Alarm]:
        count = len(self.balances)
        self._blocks += 1
        driven = _basis(rows[:, count:])
        covariates = driven.mean(axis=0)
        if self._low is None:
            if np.isfinite(covariates).all():
                self._learned.append((rows[:, :count], driven))
                self._learned_at.append(self._blocks)
            if len(self._learned) * self.size * self.period >= self.settings.learn:
                self._conclude()
            return []
        if self._to_make:
            self._make()
            return []
        if not ((covariates >= self._low) & (covariates <= self._high)).all():
            self.passed_over += 1
            return []
        found = []
        for column, (slopes, charts) in self._charts.items():
            if self.balances[column] in self.alarms:
                continue
            values = _features(rows[:, column], driven, slopes)
            told = [(chart.take(value, covariates, self._blocks), feature)
                    for chart, value, feature in zip(charts, values, FEATURES, strict=True)]
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
        time = np.array(self._learned_at)
        for column in watched:
            slopes = _slopes(covariates, means[:, column])
            values = np.array([_features(r[:, column], d, slopes)
                               for r, d in zip(rows, driven, strict=True)]).T
            usual = float(np.nanmean(np.expm1(values[1])))
            least = float(np.log1p(self.settings.least ** 2 / (1.0 + usual)))
            self._charts[column] = slopes, []
            self._to_make += [
                (column, partial(Chart, values[0], covariates, time, rate, matched,
                                 self.settings.least)),
                (column, partial(Chart, values[1], covariates, time, rate, [0], least))]
        self._learned.clear()
        self._learned_at.clear()

    def _make(self) -> None:
        """Make the next chart, one each :data:`MAKING` blocks: it takes a quarter of a second."""
        if not self._blocks % MAKING:
            column, chart = self._to_make.pop(0)
            self._charts[column][1].append(chart())


def _basis(covariates: np.ndarray) -> np.ndarray:
    """Return what a residual may depend on, shape (n, 1 + 2 m): one, covariates, their sizes."""
    return np.hstack([np.ones((len(covariates), 1)), covariates, np.abs(covariates)])


def _slopes(covariates: np.ndarray, means: np.ndarray) -> np.ndarray:
    """Return the shares of the covariates in the means, as far as they are known."""
    good = np.isfinite(means)
    size = np.maximum(np.abs(covariates).max(axis=0), 1e-12)
    basis = covariates[good] / size
    gram = basis.T @ basis + 1e-6 * len(basis) * np.eye(len(size))
    return np.linalg.solve(gram, basis.T @ means[good]) / size


def _features(rows: np.ndarray, driven: np.ndarray, slopes: np.ndarray) -> tuple[float, float]:
    """Return the mean, and the logarithm of one and the variance of what the slopes leave."""
    return float(rows.mean()), float(np.log1p((rows - driven @ slopes).var()))
