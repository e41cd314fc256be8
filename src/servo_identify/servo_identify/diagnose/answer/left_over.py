"""What an explanation leaves of the equations, in their units."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from servo_twin.balances.equation_terms import UNITS

from ..mechanisms.hypothesis import Columns
from ..selection.choice import Fitted
from .closed_equations import still_off
from .evidence import Evidence

CORRELATED = float(np.exp(-1.0))  # at the time constant of what decays exponentially


def residuals(evidence: Evidence, fit: Fitted) -> np.ndarray:
    """Return what a fit leaves at all samples, (samples,), each in the unit of its equation."""
    samples, found = evidence.found.samples, evidence.found
    tables = [Columns(samples.base[:, None]), Columns(found.nuisance.columns),
              *(one.columns for one in found.hypotheses)]
    sizes = np.cumsum([0, *(table.size for table in tables)])
    total = np.zeros(len(samples.base))
    for k, table in enumerate(tables):
        inside = np.flatnonzero((fit.columns >= sizes[k]) & (fit.columns < sizes[k + 1]))
        if len(inside):
            total += table.whole()[:, fit.columns[inside] - sizes[k]] @ fit.values[inside]
    return np.asarray(total * samples.scale)


def left_over(evidence: Evidence) -> dict[str, dict[str, object]]:
    """
    Return what is left of each equation that is still certainly off, by its name.

    ``rms`` in the ``unit`` of the equation, and ``seconds``: the time constant with which what is
    left forgets itself.
    """
    off = still_off(evidence)
    if not off:
        return {}
    samples, found = evidence.found.samples, {}
    rest = residuals(evidence, evidence.found.explanation.smallest)
    for name in off:
        several = []
        for number, errors in enumerate(samples.errors):
            if name in errors.equations:
                kept = samples.kept(number, name)
                series = np.full(len(kept), np.nan)
                series[kept] = rest[samples.part(number, name)]
                several.append((series, float(np.median(np.diff(errors.times(name))))))
        found[name] = {'rms': float(np.sqrt(np.mean(rest[samples.rows(name)]**2))),
                       'unit': evidence.servo.reads(UNITS[name], name),
                       'seconds': correlation_time(several)}
    return found


def correlation_time(several: Sequence[tuple[np.ndarray, float]]) -> float:
    """
    Return the lag, s, at which series are correlated with themselves by 1/e.

    Each comes with its spacing, s, and may hold NaN. A series that is as much alike at all lags
    gives half of the longest.
    """
    widest = max(spacing for _, spacing in several)
    most = int(max(len(series) * spacing for series, spacing in several) / widest) // 2
    power = sum(float(np.nansum(series**2)) for series, _ in several)
    count = sum(int(np.isfinite(series).sum()) for series, _ in several)
    before = 1.0
    for lag in range(1, most):
        rows = [(series, round(lag * widest / spacing)) for series, spacing in several]
        products = [series[k:] * series[:-k] for series, k in rows if len(series) > k]
        pairs = sum(int(np.isfinite(one).sum()) for one in products)
        if not pairs or not power:
            break
        now = sum(float(np.nansum(one)) for one in products) / pairs * count / power
        if now < CORRELATED:
            return widest * (lag - (CORRELATED - now) / (before - now))
        before = now
    return widest * most
