"""
The weighted least squares of a fit: residuals, their derivatives and the normal equations.

Written as bundle adjustment is: parameters that all share (physics, delays, zeros) and unknowns of
one horizon each (offsets of its start) that are eliminated block by block.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .free_values import Freedom
from .gram_matrices import grams
from .segments import CHANNELS
from .shooting import moved, Shooting, Unknowns
from .start_uncertainty import start_deviations

COARSE, FINE, FINEST = 3e-2, 3e-4, 3e-5
"""
Steps of the differences, as shares of a parameter's scale.

A shaft that sticks and teeth that strike make the cost rough: derivatives over a small step tell
of the roughness, those over a large one of the slope beneath it. The finest is for standard errors
alone: over a longer one the trajectories bend, and a scale that all torques share, which only the
torque sensor knows, then seems to be known from the angles.
"""

MODEST = 1e-3
"""What is judged to be excited must show beyond this share of a channel's motion."""


@dataclass(frozen=True)
class Normal:
    """
    Normal equations at a point, starts eliminated.

    ``cost`` half the weighted sum of squares with priors; ``gradient`` (p,), ``hessian`` (p, p) in
    scaled parameters; ``scores`` (horizons, p) share of each horizon in the gradient; ``back`` and
    ``still`` give the starts of a step: ``still + back @ step``; ``residual`` (rows, channels) the
    weighted residual there.
    """

    cost: float
    gradient: np.ndarray
    hessian: np.ndarray
    scores: np.ndarray
    back: np.ndarray
    still: np.ndarray
    residual: np.ndarray


class Problem:
    """Parameters, delays and zeros against residuals; all in units of their scales."""

    def __init__(self, shooting: Shooting, freedom: Freedom, delays: bool, robust: bool) -> None:
        self.shooting, self.freedom, self.robust = shooting, freedom, robust
        courses = shooting.courses
        self.firsts, self.owner = shooting.edges()
        self.measured = shooting.stacked([c.measured for c in courses])
        self.noise = shooting.stacked([np.broadcast_to(c.noise, c.measured.shape)
                                       for c in courses])
        self.blind = ~np.isfinite(self.measured)
        self.inverse = np.where(np.isfinite(self.measured), 1.0 / self.noise, 0.0)
        self.lengths = np.diff(np.append(self.firsts, len(self.measured)))
        self.course = np.repeat(self.owner, self.lengths)
        self.period = np.array([c.period for c in courses])[self.course]
        self.factor = np.ones((len(courses), len(CHANNELS)))
        self.carry = np.zeros((len(courses), len(CHANNELS)))
        seen = np.isfinite(self.measured).any(axis=0)
        self.late = np.flatnonzero(seen) if delays else np.array([], dtype=int)
        self.step = COARSE
        self.damping = np.zeros(len(self.firsts))
        self.zeroed = np.flatnonzero(shooting.both)
        self.late_scale = min(c.period for c in courses)
        self.start_scale, self.start_deviation = start_deviations(shooting)
        self.zero_scale = 1e-5 if not len(self.zeroed) else float(np.median(
            self.start_scale[:, 0]))

    @property
    def start_prior(self) -> np.ndarray:
        """
        Deviations of the starts, wider while the data weigh less, (horizons, offsets).

        Not those of a torsion that two encoders measure, where nothing but starts is free: it
        would throw the load to where a twin that drifts should be.
        """
        least = np.maximum(self.factor[:, :2].min(axis=1), 0.01)
        wide = np.repeat(1.0 / least[self.owner, None], self.shooting.offsets, axis=1)
        if not len(self.freedom):
            wide[self.shooting.both[self.owner], 2:] = 1.0
        return self.start_deviation * wide

    @property
    def size(self) -> int:
        """How many numbers all horizons share."""
        return len(self.freedom) + len(self.late) + len(self.zeroed)

    def be_modest(self) -> None:
        """Weigh channels as if no model were better than :data:`MODEST` of their motion."""
        known = np.isfinite(self.measured)
        total = np.add.reduceat(np.where(known, self.measured, 0.0), self.firsts)
        count = np.maximum(1, np.add.reduceat(known, self.firsts, dtype=int))
        around = np.repeat(total / count, self.lengths, axis=0)
        motion = np.where(known, self.measured - around, 0.0) / self.noise
        motion[~known] = 0.0
        for i in range(len(self.factor)):
            size = np.sqrt(np.mean(motion[self.course == i] ** 2, axis=0))
            self.factor[i] = 1.0 / np.maximum(1.0, MODEST * size)

    def residual(self, y: list[np.ndarray]) -> np.ndarray:
        """Weighted residual twin minus rig, (rows, channels); zero where nothing is compared."""
        return self.weighed(self.raw(y))

    def raw_of(self, unknowns: Unknowns) -> np.ndarray:
        """Twin minus rig in units of the noise floor, (rows, channels)."""
        return self.raw(self.shooting.simulate([unknowns])[0])

    def weighed(self, raw: np.ndarray) -> np.ndarray:
        """Return raw residuals whitened and weighed."""
        return self.whitened(raw) * self.factor[self.course]

    def whitened(self, raw: np.ndarray) -> np.ndarray:
        """Take from each residual its share of the one before, within horizons."""
        if not self.carry.any():
            return raw
        before = np.vstack([raw[:1], raw[:-1]])
        before[self.firsts] = 0.0
        with np.errstate(invalid='ignore'):
            white = raw - self.carry[self.course] * before
        white[self.firsts] = raw[self.firsts] * np.sqrt(
            1.0 - self.carry[self.course[self.firsts]] ** 2)
        white[np.isnan(white)] = np.inf
        return white

    def raw(self, y: list[np.ndarray]) -> np.ndarray:
        """Twin minus rig of rolled-out outputs, in units of the noise floor, (rows, channels)."""
        error = (self.shooting.stacked(y) - self.measured) / self.noise
        error[self.blind] = 0.0
        finite = np.isfinite(error)
        if not finite.all():
            error[~finite] = np.inf
        return error

    def costs(self, residual: np.ndarray, unknowns: Unknowns) -> np.ndarray:
        """Half the (robust) sum of squares of each horizon, priors of its start included."""
        prior = 0.5 * np.sum((unknowns.starts / self.start_prior) ** 2, axis=1)
        if self.robust:
            size = np.abs(residual)
            loss = np.where(size < 1.5, 0.5 * size**2, 1.5 * size - 1.125)
        else:
            loss = 0.5 * residual**2
        return np.add.reduceat(loss.sum(axis=1), self.firsts) + prior

    def evaluate(self, unknowns: Unknowns) -> tuple[np.ndarray, float]:
        """Return residual and cost."""
        residual = self.weighed(self.raw_of(unknowns))
        return residual, float(self.costs(residual, unknowns).sum())

    def steps(self, unknowns: Unknowns) -> list[tuple[Unknowns, float]]:
        """Return the points of the differences and what one unit of each column is worth."""
        free, points = self.freedom, []
        for k, index in enumerate(free.index):
            by = self.step * free.scale[k]
            if unknowns.theta[index] + by > free.high[k]:
                by = -by
            points.append((moved(unknowns, index, by), by / free.scale[k]))
        for column in range(self.shooting.offsets):
            starts = unknowns.starts.copy()
            starts[:, column] += self.start_scale[:, column]
            points.append((replace(unknowns, starts=starts), 1.0))
        if len(self.zeroed):
            zeros = unknowns.zeros + self.zero_scale
            points.append((replace(unknowns, zeros=zeros), 1.0))
        return points

    def linearised(self, unknowns: Unknowns) -> Normal:
        """Return the normal equations at a point."""
        points = self.steps(unknowns)
        rolled = self.shooting.simulate([unknowns] + [p for p, _ in points])
        residual = self.residual(rolled[0])
        stacked = np.array([self.shooting.stacked(y) for y in rolled])
        rates = np.empty((len(self.late), len(residual)))
        for k, c in enumerate(self.late):
            rate = np.gradient(stacked[0, :, c]) / self.period
            rate[self.firsts] = rate[np.minimum(self.firsts + 1, len(rate) - 1)]
            rates[k] = -rate * self.late_scale
        edges = np.append(self.firsts, len(residual))
        unit = np.array([worth for _, worth in points])

        def part(ends: tuple[int, int]) -> np.ndarray:
            return grams(*ends, stacked, unit, rates, self.late, self.inverse,
                         self.inverse.any(axis=0), self.carry, self.factor, edges, self.owner,
                         residual, self.robust)

        cuts = np.unique(np.linspace(0, len(self.owner), self.shooting.threads + 1).astype(int))
        parts = self.shooting.pool.map(part, zip(cuts[:-1], cuts[1:], strict=True))
        return self._normal(unknowns, residual, np.concatenate(list(parts)))

    def _normal(self, unknowns: Unknowns, residual: np.ndarray, gram: np.ndarray) -> Normal:
        count, offsets = len(self.freedom), self.shooting.offsets
        zero, behind = count + offsets, gram.shape[1] - 1 - len(self.late)
        own, flat = slice(count, zero), gram.shape[1] - 1
        shared = [*range(count), *range(behind, flat), *(zero for _ in self.zeroed)]
        mine = np.ones((len(gram), len(shared)))  # the zero of a recording moves no other
        mine[:, len(shared) - len(self.zeroed):] = self.owner[:, None] == self.zeroed
        prior = (self.start_scale / self.start_prior) ** 2
        inner = gram[:, own, own].copy()
        inner[:, range(offsets), range(offsets)] += prior
        inner[:, range(offsets), range(offsets)] *= 1.0 + self.damping[:, None]
        slope = gram[:, own, flat] + (
            unknowns.starts * self.start_scale / self.start_prior**2)
        cross = gram[:, own][:, :, shared] * mine[:, None, :]
        back = -np.linalg.solve(inner, cross)
        still = -np.linalg.solve(inner, slope[:, :, None])[:, :, 0]
        scores = gram[:, flat][:, shared] * mine + np.einsum('hik,hi->hk', back, slope)
        products = gram[:, shared][:, :, shared] * mine[:, None, :] * mine[:, :, None]
        hessian = products.sum(axis=0) + np.einsum('hik,hil->kl', back, cross)
        return Normal(float(self.costs(residual, unknowns).sum()), scores.sum(axis=0),
                      0.5 * (hessian + hessian.T), scores, back, still, residual)

    def stepped(self, unknowns: Unknowns, normal: Normal, step: np.ndarray,
                share: float = 1.0) -> Unknowns:
        """
        Return the unknowns after a step of the shared numbers, in units of their scales.

        The starts go ``share`` of the way that the linear model says.
        """
        count, free = len(self.freedom), self.freedom
        theta = unknowns.theta.copy()
        theta[free.index] = np.clip(theta[free.index] + step[:count] * free.scale, free.low,
                                    free.high)
        delays = unknowns.delays.copy()
        delays[self.late] += step[count:count + len(self.late)] * self.late_scale
        zeros = unknowns.zeros.copy()
        zeros[self.zeroed] += step[count + len(self.late):] * self.zero_scale
        way = (normal.still + normal.back @ step) * self.start_scale
        starts = unknowns.starts + share * way
        return Unknowns(theta, starts, zeros, delays)

    def room(self, unknowns: Unknowns) -> tuple[np.ndarray, np.ndarray]:
        """Return how far each shared number may move down and up, in units of its scale."""
        free = self.freedom
        value = unknowns.theta[free.index]
        late = unknowns.delays[self.late] / self.late_scale
        wide = np.full(len(self.zeroed), np.inf)
        return (np.concatenate([(free.low - value) / free.scale, -20.0 - late, -wide]),
                np.concatenate([(free.high - value) / free.scale, 20.0 - late, wide]))
