"""Which orders of a turn a residual repeats at: a least-squares periodogram over the angle."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial

import numpy as np
from scipy.optimize import minimize_scalar

from servo_twin.balances.equation_terms import EQUATIONS

from ..decisions import FORM
from .builder import Builder
from .hypothesis import Form, Hypothesis, Mechanism, Series

LARGEST_ORDER = 200  # up to which parts of an order are told apart
LARGEST_WHOLE = 512  # up to which whole orders are: slots times poles of a direct drive
MOST = 6  # orders of any kind that one hypothesis takes in; another takes in half of them
SERIES = (3, 8)  # multiples of one order that it takes in: of what is round, and of what has edges
FEWEST = 50  # samples that say anything
APART, PARTS, MOST_PARTS = 2.0, 4, 256  # turns that tell orders from whole ones; steps of these
RANGES = 5.12  # of each wave of the largest order, over which samples are summed up


def waves(angle: np.ndarray, orders: Iterable[float]) -> np.ndarray:
    """Return cosine and sine of an angle (rad) at each order, shape (samples, 2 orders)."""
    return np.column_stack([wave for order in orders
                            for wave in (np.cos(order * angle), np.sin(order * angle))])


def rises(angle: np.ndarray, orders: Sequence[float]) -> np.ndarray:
    """Return how :func:`waves` rise with the angle, (samples, 2 orders), 1/rad."""
    turned = np.arange(2 * len(orders)) ^ 1  # sine for cosine and the other way about
    return waves(angle, orders)[:, turned] * np.outer(orders, (-1.0, 1.0)).ravel()


def _waving(factor: Series, angle: str, orders: Sequence[float]) -> Series:
    return lambda one: factor(one)[:, None] * waves(one.motion[angle], orders)


def hats(x: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return piecewise linear hat functions of ``x`` at ``edges``, (samples, edges)."""
    return np.column_stack([np.interp(x, edges, unit) for unit in np.eye(len(edges))])


def periodic(builder: Builder, mechanism: Mechanism, residual: np.ndarray, equation: str,
             angle: str, signal: str, times: str, factor: Series, y_unit: str, least: float = 1.0,
             mean: bool = False, lowest: int = 1) -> Iterator[Hypothesis]:
    """
    Yield hypotheses of waves over an angle.

    These are the strongest order, it (or a part of it) with its multiples, and the strongest ones.
    ``times`` names what the waves are multiplied by in the search, ``factor(errors, number)``
    returns it; ``signal`` is what they are in the equations, ``y_unit`` their unit. ``mean``: what
    varies has a mean too. Orders below ``lowest`` are not tried.
    """
    if not builder.turns(angle):
        return
    found, tried = orders_of(builder, equation, angle, residual, times, least, lowest)
    if not found:
        return
    for some in series_of(found, lowest):
        orders = (0.0, *some)[not mean:]
        columns = builder.place(signal, _waving(factor, angle, orders))
        knots = tuple(order for order in orders for _ in range(2))
        form = Form('angle', 'rad', y_unit, lambda one: one.motion[angle],
                    partial(waves, orders=orders))
        one = builder.hypothesis(mechanism, columns, [0] * len(knots), knots, tried=tried,
                                 form=form)
        if one:
            yield one


def series_of(found: tuple[float, ...], lowest: int = 1) -> list[tuple[float, ...]]:
    """Return the sets of orders that are tried together, of those that were ``found``."""
    first = found[0]
    bases = [first / k for k in (1, 2, 3)
             if k == 1 or first % k == 0 and first / k >= lowest]
    series = (tuple(base * k for k in range(1, multiples + 1))
              for base in bases for multiples in SERIES)
    return list(dict.fromkeys(((first,), *series, found[:MOST // 2], found)))


def orders_of(builder: Builder, equation: str, angle: str, residual: np.ndarray, times: str = '',
              least: float = 1.0, lowest: int = 1) -> tuple[tuple[float, ...], int]:
    """
    Return (orders at which the residual of an equation repeats over an angle, how many tried).

    ``times`` names what the wave is multiplied by: direction, current, load, the sign of this, or
    the square of the speed.
    An order is tried where the shaft covers at least so much of its period, ``least``. The
    strongest comes first.
    """
    samples = builder.samples
    if equation not in samples.present:
        return (), 0
    rows = samples.equation == EQUATIONS.index(equation)
    at, target = samples.of_motion(equation, angle), residual[rows]
    factor = np.ones(len(target))
    if times == 'direction':
        factor = samples.of_motion(equation, 'direction')
    elif times == 'square of speed':
        factor = samples.of_motion(equation, 'load_speed') ** 2
        factor /= factor.max(initial=0.0) or 1.0
    elif times == 'current':  # what the motion asks for: not every rig measures it, or the torque
        factor = samples.along(equation, lambda one, motion: builder.rippling(one))
        factor /= builder.scales.current or 1.0
    elif times == 'flank':
        factor = samples.along(equation, lambda one, motion: one.flank(motion))
    elif times == 'load':
        factor = samples.along(equation, lambda one, motion: one.transmitted(motion))
        factor /= builder.scales.torque or 1.0
    largest = builder.scales.most_waves(angle)
    if samples.servo.straight(angle):
        return along_travel(at, target, factor, least, largest)
    return strongest(at, target, factor, least, lowest, largest)


def along_travel(x: np.ndarray, target: np.ndarray, factor: np.ndarray, least: float,
                 largest: float = np.inf) -> tuple[tuple[float, ...], int]:
    """
    Return the same for what moves straight, in rad/m: no period of it is a whole part of a turn.

    Waves are counted over the travel ``x`` (m), as :func:`strongest` counts them over a turn.
    """
    known = x[np.isfinite(x)]
    unit = 2.0 * np.pi / max(float(np.ptp(known)) if len(known) else 0.0, 1e-12)
    found, tried = strongest(unit * x, target, factor, least, 1, largest / unit, whole=False)
    return tuple(unit * order for order in found), tried


def strongest(angle: np.ndarray, target: np.ndarray, factor: np.ndarray, least: float,
              lowest: int = 1, largest: float = np.inf, whole: bool = True
              ) -> tuple[tuple[float, ...], int]:
    """
    Return (the orders that take most of a target, how many were tried).

    ``whole`` ones are the rule. Where the angle covers some turns, others are told from them, as
    that of a shaft between motor and load. Those above the ``largest`` are none that a reading
    tells.
    """
    good = np.isfinite(angle) & np.isfinite(target) & np.isfinite(factor)
    if good.sum() < FEWEST:
        return (), 0
    angle, target, factor = angle[good], target[good], factor[good]
    turns = max(float(np.ptp(angle)), 1e-12) / (2.0 * np.pi)
    lowest = max(lowest, int(np.ceil(least / turns)))
    if lowest > min(LARGEST_ORDER, largest):
        return (), 0
    parts = int(np.clip(PARTS * turns, 1, MOST_PARTS)) if turns >= APART or not whole else 1
    apart = 1.0 if parts == 1 else 1.0 / turns  # orders that differ by less are one
    found: list[float] = []
    left = target - _fitted(factor[:, None], target)
    for _ in range(MOST):
        best = _peak(angle, left, factor, lowest, parts, largest, whole)
        if any(abs(best - other) < apart for other in found):
            break
        found.append(best)
        table = np.column_stack((factor, *(factor[:, None] * waves(angle, found)).T))
        left = target - _fitted(table, target)
    tried = (LARGEST_ORDER + 1 - lowest) / apart + LARGEST_WHOLE - LARGEST_ORDER
    return tuple(found), int(tried)


def _peak(angle: np.ndarray, target: np.ndarray, factor: np.ndarray, lowest: int,
          parts: int, largest: float, whole: bool) -> float:
    """Return the order that takes most, or a ``whole`` one beside it that takes nearly as much."""
    power = periodogram(angle, target, factor, parts)
    power[:lowest * parts] = 0.0
    beyond = periodogram(angle, target, factor, largest=LARGEST_WHOLE)
    beyond[:LARGEST_ORDER + 1] = 0.0
    power[np.arange(len(power)) > largest * parts] = 0.0
    beyond[np.arange(len(beyond)) > largest] = 0.0
    top, far = int(np.argmax(power)), int(np.argmax(beyond))
    if beyond[far] > power[top]:
        if whole:
            return float(far)
        top = far * parts
    near = round(top / parts)
    if whole and power[near * parts] >= (1.0 - FORM) * power[top]:
        return float(near)

    def left(order: float) -> float:
        table = factor[:, None] * waves(angle, (order,))
        return float(np.sum((target - _fitted(table, target)) ** 2))

    return float(minimize_scalar(left, bounds=((top - 1) / parts, (top + 1) / parts),
                                 method='bounded', options={'xatol': 0.01 / parts}).x)


def periodogram(angle: np.ndarray, target: np.ndarray, factor: np.ndarray,
                parts: int = 1, largest: int = LARGEST_ORDER) -> np.ndarray:
    """
    Square that cosine and sine of each order, times a factor, take from a target.

    The orders go from 0 to the ``largest`` in steps of ``1 / parts``. By the Fourier transform of
    sums over narrow ranges of the angle.
    """
    ranges = int(RANGES * largest) * parts
    place = np.floor(np.mod(angle / (2.0 * np.pi * parts), 1.0) * ranges).astype(int) % ranges
    orders = np.arange(largest * parts + 1)
    shift = np.exp(-1j * np.pi * orders / ranges)  # the middle of a range
    both, twice = (np.conj(np.fft.rfft(np.bincount(place, w, ranges)))
                   for w in (factor * target, factor**2))
    taken, again = both[orders] * np.conj(shift), twice[2 * orders] * np.conj(shift) ** 2
    total = 0.5 * float(factor @ factor)
    even, odd = total + 0.5 * again.real, total - 0.5 * again.real
    cross = 0.5 * again.imag
    area = even * odd - cross**2
    square = odd * taken.real**2 - 2.0 * cross * taken.real * taken.imag + even * taken.imag**2
    sound = area > (1e-6 * total) ** 2
    return np.where(sound, square / np.where(sound, area, 1.0), 0.0)


def _fitted(table: np.ndarray, target: np.ndarray) -> np.ndarray:
    return table @ np.linalg.lstsq(table, target, rcond=1e-9)[0]
