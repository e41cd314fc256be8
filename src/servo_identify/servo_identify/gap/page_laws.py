"""The laws in the residuals: a balance over the variable on which it depends, before and after."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from servo_twin.balances.goodness_of_fit import shown_unit

from .balance import BALANCES, UNITS
from .candidates import Candidate
from .completeness import features, VARIABLES

DOTS = 900  # of a residual that are drawn
BINS = 36  # along a variable, by which its law is drawn
FEWEST = 5  # samples of which a median is drawn
ABSORBED = 0.3  # share of a law that is shown alone where tolerances could explain the rest
AS_GOOD = 0.03  # share of a law by which a more familiar variable may explain less of it

VARIABLE_UNITS = {
    'angle of the load': 'rad', 'angle of the motor': 'rad', 'speed': 'rad/s', 'torque': 'N m',
    'current': 'A', 'wind-up': 'rad', 'acceleration': 'rad/s²', 'direction': '',
    'travel since reversal': 'rad', 'time': 's', 'temperature': '°C',
}
FAMILIAR = ('speed', 'torque', 'angle of the load', 'angle of the motor', 'current', 'wind-up',
            'acceleration', 'travel since reversal', 'temperature', 'time')
"""Variables of which a law is drawn; of those that explain it alike, the first."""


SIGNED = ('speed', 'torque', 'current', 'wind-up')
"""Variables over which an odd law is odd as it stands."""


@dataclass(frozen=True)
class Law:
    """
    The residual of a balance over the variable on which it depends, and the law through it.

    ``dots`` maps 'before' and 'after' to (x, y), ``curves`` the side of a law to (x, y). Where
    ``bounded``, what tolerances could explain as well was left out.
    """

    title: str
    balance: str
    unit: str
    variable: str
    variable_unit: str
    dots: dict[str, tuple[np.ndarray, np.ndarray]]
    curves: dict[str, tuple[np.ndarray, np.ndarray]]
    bounded: bool = False


def laws(evidence) -> list[Law]:
    """Return for each accepted cause the residual that it explains, in the order of accepting."""
    stack, shown, known = evidence.stacks['screen'], [], {}
    freedom = stack.nuisances() if evidence.choices else None
    for choice in evidence.choices:
        share = contribution(evidence, choice.candidate)
        missed = _missed(evidence, choice.candidate, share, freedom)
        bounded = np.mean(missed**2) < ABSORBED**2 * np.mean(share**2)
        share = missed if bounded else share
        drop = (evidence.left + share)**2 - evidence.left**2
        drops = {i: float(np.mean(drop[stack.balance == i])) for i in np.unique(stack.balance)}
        index = max(drops, key=drops.get)
        name, rows = BALANCES[index], stack.balance == index
        if not share[rows].any():
            continue
        if name not in known:
            known[name] = features(stack, name)
        table, variables = _with_phase(known[name], evidence, choice.candidate)
        taken = share[rows] * stack.scale[rows]
        left = evidence.left[rows] * stack.scale[rows]
        column = _variable(table, variables, taken)
        x, way = table[:, column], table[:, VARIABLES.index('direction')]
        near = _where_it_acts(x, taken)
        x, taken, left, way = x[near], taken[near], left[near], way[near]
        shown.append(_law(choice.candidate.label.replace('_', ' '), name, evidence.servo.linear,
                          variables[column], x, {'before': left + taken, 'after': left},
                          _by_direction(x, taken, way), bool(bounded)))
    return shown


def contribution(evidence, cause: Candidate) -> np.ndarray:
    """Return what a cause explains of the screen residuals, in units of their scale."""
    stack, explanation = evidence.stacks['screen'], evidence.best.explanation
    theta, on = explanation.theta.copy(), explanation.on.copy()
    if cause.switch is not None:
        on[cause.switch] = False
    else:
        for path, element in zip(cause.paths, cause.elements, strict=True):
            slot = stack.extended.slot(path, element)
            theta[slot] = stack.extended.theta[slot]
    return stack.at(theta, on) - stack.at(explanation.theta, explanation.on)


def _missed(evidence, cause: Candidate, share: np.ndarray, freedom) -> np.ndarray:
    """Return what of a cause's share the tolerances, fitted anew without it, do not explain."""
    stack = evidence.stacks['screen']
    labels, columns, low, high = freedom
    extended, theta = stack.extended, evidence.best.explanation.theta
    others = {p for c in evidence.choices for p in c.candidate.paths} - set(cause.paths)
    moved = np.array([
        theta[extended.slot(label)] - extended.theta[extended.slot(label)]
        if label in extended.servo.values and label not in cause.paths else 0.0
        for label in labels])
    free = np.flatnonzero([label not in others for label in labels])
    weight = np.sqrt((columns[:, free]**2).sum(axis=0)) + 1e-300
    bounds = np.minimum(low[free] - moved[free], 0.0), np.maximum(high[free] - moved[free], 1e-12)
    basis, table = np.linalg.qr(columns[:, free] / weight)
    found = lsq_linear(table, -basis.T @ (evidence.left + share),
                       (bounds[0] * weight, bounds[1] * weight))
    return share + columns[:, free] @ (found.x / weight)


def unexplained(evidence, balance: str) -> Law | None:
    """Return what is left of a balance over its strongest variable, with the flexible curve."""
    stack = evidence.stacks['screen']
    remainder = next((r for r in evidence.remainders if r.balance == balance), None)
    rows = stack.balance == (BALANCES.index(balance) if balance in BALANCES else -1)
    if not rows.any():
        return None
    depends_on = remainder.depends_on if remainder is not None else ()
    name = next((v for v in depends_on if v != 'direction'), 'speed')
    table, scale = features(stack, balance), stack.scale[rows]
    x, way = table[:, VARIABLES.index(name)], table[:, VARIABLES.index('direction')]
    title, curves = f'what is left in the {balance} balance', {}
    dots = {'after': evidence.left[rows] * scale}
    if evidence.choices:
        dots = {'before': evidence.start[rows] * scale, **dots}
    flips = remainder is not None and remainder.parity == 'odd' and name not in SIGNED
    if flips:  # forward and backward would cancel in one curve
        title += ', times the direction of motion'
        dots = {side: y * way for side, y in dots.items()}
        curves['median'] = _middles(x, dots['after'])
    elif depends_on and remainder.curve is not None:
        curves['flexible'] = (remainder.curve[0], remainder.curve[1] * float(np.median(scale)))
    if curves:
        (grid, height), = curves.values()
        near = _where_it_acts(grid, height)
        inside = (x >= grid[near].min()) & (x <= grid[near].max())
        curves = {side: (grid[near], height[near]) for side in curves}
        x, dots = x[inside], {side: y[inside] for side, y in dots.items()}
    return _law(title, balance, evidence.servo.linear, name, x, dots, curves)


def _law(title, balance, linear, variable, x, dots, curves, bounded=False) -> Law:
    some = _spread(x)
    unit = VARIABLE_UNITS.get(variable, 'rad')
    return Law(title, balance, shown_unit(UNITS[balance], linear), variable,
               shown_unit(unit, linear), {n: (x[some], y[some]) for n, y in dots.items()}, curves,
               bounded)


def _spread(x: np.ndarray) -> np.ndarray:
    """Pick dots by chance, about as many from each stretch of x."""
    if len(x) <= DOTS:
        return np.arange(len(x))
    order = np.random.default_rng(0).permutation(len(x))
    cell = np.minimum((x[order] - x.min()) / max(np.ptp(x), 1e-300) * BINS, BINS - 1).astype(int)
    rank = np.empty(len(x), dtype=int)
    for k in range(BINS):
        rank[cell == k] = np.arange(np.count_nonzero(cell == k))
    return order[np.argsort(rank, kind='stable')[:DOTS]]


def _where_it_acts(x: np.ndarray, taken: np.ndarray) -> np.ndarray:
    """Rows of the stretch of x in which a law does nearly all that it does, with its margins."""
    order = np.argsort(x)
    done = np.cumsum(taken[order]**2)
    if done[-1] == 0.0:
        return np.ones(len(x), dtype=bool)
    low, high = x[order][np.searchsorted(done, np.array((0.01, 0.99)) * done[-1])]
    margin = 0.5 * (high - low)
    return (x >= low - margin) & (x <= high + margin)


def _with_phase(table: np.ndarray, evidence, cause: Candidate):
    """Add the phase within one period where a cause has an order, as (table, variables)."""
    extended = evidence.stacks['screen'].extended
    path = next((p for p, _ in cause.shapes if p.endswith('.order')), None)
    if path is None:
        return table, VARIABLES
    order = float(evidence.best.explanation.theta[extended.slot(path)])
    shaft = 'motor' if cause.site == 'motor' else 'load'
    angle = table[:, VARIABLES.index(f'angle of the {shaft}')]
    name = f'angle of the {shaft} within one period of order {order:g}'
    return (np.column_stack((table, np.mod(angle, 2.0 * np.pi / max(order, 1e-9)))),
            (*VARIABLES, name))


def _variable(table: np.ndarray, variables: tuple[str, ...], taken: np.ndarray) -> int:
    """Index of the variable by which, beside the direction, a law is explained best."""
    way, explained = table[:, VARIABLES.index('direction')], {}
    for name in (*variables[len(VARIABLES):], *FAMILIAR):
        x = table[:, variables.index(name)]
        fitted = np.zeros(len(x))
        for side in (-1.0, 1.0):
            mine = (way > 0) == (side > 0)
            if mine.sum() > BINS:
                bins = np.digitize(x[mine], _edges(x[mine])[1:-1])
                counts = np.maximum(np.bincount(bins), 1)
                fitted[mine] = (np.bincount(bins, taken[mine]) / counts)[bins]
        explained[name] = float(np.mean((taken - fitted)**2) / max(np.mean(taken**2), 1e-300))
    least = min(explained.values())
    return variables.index(next(n for n, e in explained.items() if e <= least + AS_GOOD))


def _by_direction(x: np.ndarray, y: np.ndarray, way: np.ndarray) -> dict:
    """Medians of y along x: one curve, or one for each direction where that tells more."""
    sides = {'forward': way > 0, 'backward': way <= 0}
    sides = {name: rows for name, rows in sides.items() if rows.sum() > BINS}
    whole = _middles(x, y)
    if len(sides) < 2:
        return {'law': whole}
    curves = {name: _middles(x[rows], y[rows]) for name, rows in sides.items()}
    together = np.mean(np.abs(y - np.interp(x, *whole)))
    apart = sum(np.sum(np.abs(y[rows] - np.interp(x[rows], *curves[name])))
                for name, rows in sides.items()) / len(y)
    return curves if apart < 0.75 * together else {'law': whole}


def _middles(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Medians of y along x: where the bump spans periods of a law, it reads little of it."""
    bins = np.digitize(x, _edges(x)[1:-1])
    counts = np.bincount(bins)
    good = np.flatnonzero(counts >= min(FEWEST, counts.max()))
    # with its neighbours, for a bin may hold one stretch of one recording only
    near = [np.flatnonzero(np.abs(bins - b) <= 1) for b in good]
    return (np.array([np.median(x[bins == b]) for b in good]),
            np.array([np.median(y[rows]) for rows in near]))


def _edges(x: np.ndarray) -> np.ndarray:
    """Edges of bins, half of them even in x and half even in the number of samples."""
    share = np.linspace(0.0, 1.0, BINS // 2 + 1)
    return np.unique(np.concatenate((np.quantile(x, share), x.min() + share * np.ptp(x))))
