"""The measured curve of an accepted mechanism, and its band."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from ..mechanisms.hypothesis import Hypothesis, Mechanism
from ..selection.explain import Explained

POINTS = 41  # of a curve
PER_WAVE, MOST_POINTS = 12, 721  # of one that waves, so that its highest order shows
PER_KNOT = 2  # of one with narrow places
ENDS = (1.0, 99.0)  # percentiles of its variable between which it is drawn
BAND = (5.0, 95.0)  # percentiles of the redrawn curves


@dataclass(frozen=True)
class Curve:
    """
    A mechanism over one variable, with a band of 90 %, shape (points,) each.

    ``x`` in ``unit``; ``y``, ``low`` and ``high`` in ``y_unit``, as of an axis that turns.
    ``density`` (points,) is how often the recordings were there.
    """

    variable: str
    unit: str
    y_unit: str
    x: np.ndarray
    y: np.ndarray
    low: np.ndarray
    high: np.ndarray
    density: np.ndarray

    def size(self, y: np.ndarray | None = None) -> float:
        """Root mean square of the curve (or another one) where the recordings were."""
        y = self.y if y is None else y
        return float(np.sqrt(np.average(y**2, weights=self.density)))

    def mean(self) -> float:
        """Mean of the curve where the recordings were."""
        return float(self.density @ self.y / self.density.sum())

    def slope(self) -> float:
        """Slope of the straight line through zero that is nearest where the recordings were."""
        return float((self.density * self.x) @ self.y) / float((self.density * self.x) @ self.x)

    def spread(self) -> np.ndarray:
        """Return the standard deviation at each point, for a band of normal deviates."""
        return (self.high - self.low) / (norm.ppf(BAND[1] / 100.0) - norm.ppf(BAND[0] / 100.0))

    def doubt(self) -> float:
        """Return the standard deviation of the size of the curve, as a share of it."""
        return self.size(self.spread()) / self.size()

    def certain(self) -> float:
        """
        Share of the curve's squares where its band leaves zero out; 1.0 for a curve of zeros.

        What is lost beyond a limit is zero before it, and may be sure all the same.
        """
        squares = self.density * self.y**2
        whole = float(squares.sum())
        return float(squares @ (self.low * self.high > 0.0)) / whole if whole else 1.0

    def share(self, y: np.ndarray) -> Curve:
        """Return a part of the curve, with a band of the same width in proportion."""
        part = self.size(y) / max(self.size(), 1e-300)
        return replace(self, y=y, low=y + part * (self.low - self.y),
                       high=y + part * (self.high - self.y))

    def plus(self, other: Curve) -> Curve:
        """Return the sum with another curve over the same variable at the same places."""
        y = self.y + other.y
        low, high = (np.hypot(getattr(self, edge) - self.y, getattr(other, edge) - other.y)
                     for edge in ('low', 'high'))
        return replace(self, y=y, low=y - low, high=y + high)


@dataclass(frozen=True)
class Part:
    """
    One missing effect of a hypothesis (by its ``number``): its mechanism and its curve.

    ``path`` is the value of the servo file that is off instead, and ``change`` by how much.
    ``way`` is the direction (1 or -1) that has it alone; zero where both have it. ``draws``
    (redrawn, amplitudes) are the amplitudes as other recordings of the same kind might give them.
    """

    number: int
    mechanism: Mechanism
    curve: Curve | None
    amplitudes: np.ndarray
    path: str = ''
    change: float = 0.0
    way: float = 0.0
    draws: np.ndarray | None = None


def curve_of(found: Explained, number: int, draws: np.ndarray,
             amplitudes: np.ndarray | None = None) -> Curve | None:
    """
    Return the curve of a hypothesis; ``draws`` are its amplitudes, redrawn.

    ``amplitudes`` are those of the chosen set where they are not given.
    """
    amplitudes = found.amplitudes(number) if amplitudes is None else amplitudes
    one = found.hypotheses[number]
    if one.form is None:
        return None
    seen = np.concatenate([np.asarray(one.form.of(errors)) for errors in found.samples.errors])
    seen = seen[np.isfinite(seen)]
    period = one.form.period
    if one.form.variable == 'angle' and np.ptp(seen) > period and _repeats(one, seen):
        seen = np.mod(seen, period)
        ends = (0.0, period)
    else:
        ends = np.percentile(seen, ENDS)
    x = np.linspace(*ends, _points(one, float(ends[1] - ends[0])))
    table = one.form.shape(x)
    several = table @ draws.T
    low, high = np.percentile(several, BAND, axis=1)
    y = table @ amplitudes
    half = 0.5 * (x[1] - x[0])
    density = np.histogram(seen, np.append(x - half, x[-1] + half))[0].astype(float)
    return Curve(one.form.variable, one.form.unit, one.form.y_unit, x, y, np.minimum(low, y),
                 np.maximum(high, y), density + 0.01 * density.mean())


def _repeats(one: Hypothesis, angle: np.ndarray) -> bool:
    """Tell whether a mechanism repeats with the turn: a spring over several turns does not."""
    assert one.form is not None
    some = angle[::max(1, len(angle) // POINTS)]
    return one.tried > 1 or np.allclose(
        one.form.shape(some), one.form.shape(some + one.form.period))


def _points(one: Hypothesis, span: float) -> int:
    """Return at how many points a curve is drawn over a span, rad, of its variable."""
    if one.form is None or one.form.variable != 'angle' or len(one.knots) < 2:
        return POINTS
    if 'narrowest' in one.detail:
        return int(np.clip(PER_KNOT * span / one.detail['narrowest'], POINTS, MOST_POINTS))
    if one.tried < 2:
        return POINTS
    waves = max(map(float, one.knots)) * span / (2.0 * np.pi)
    return int(np.clip(PER_WAVE * waves, POINTS, MOST_POINTS))
