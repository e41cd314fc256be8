"""What each law of friction takes of a measured curve."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from scipy.optimize import nnls

from ..decisions import PRACTICAL
from .curves import Curve

SPEED_LAWS = ('coulomb_friction', 'viscous_friction', 'stribeck_friction', 'quadratic_drag')
RARE = 0.1  # share of the angles at which friction may be less than what is there elsewhere
BELLS = 8  # speeds within which friction may fall
SETTLES = np.geomspace(0.03, 10.0, 48)  # shares of a curve over time in which it settles
GROWTH = (0.5, 1.0, 2.0, 3.0)  # powers of the load with which friction may grow


def common(curve: Curve) -> float:
    """Return what resists at nearly all angles: the level that most of the curve is beyond."""
    low, high = np.quantile(curve.y, (RARE, 1.0 - RARE))
    return float(max(0.0, low) + min(0.0, high))


def settled(curve: Curve) -> float:
    r"""
    Return the level that friction comes to with time, 0 where it fades to none.

    .. math:: y = L + A\,e^{-t/T}

    It needs a level where a time alone, of at most ten times the curve, leaves more than its band
    and what matters; T is within the curve then, since a slower one is no level.
    """
    span = float(np.ptp(curve.x)) or 1.0
    weight = np.sqrt(curve.density)

    def fitted(share: float, level: bool) -> tuple[float, float]:
        table = np.column_stack((np.exp(-curve.x / (share * span)),
                                 *[np.ones(len(curve.x))] * level))
        amounts = np.linalg.lstsq(table * weight[:, None], curve.y * weight, rcond=None)[0]
        return curve.size(curve.y - table @ amounts), float(amounts[-1])

    least = max(curve.size(curve.spread()), PRACTICAL * curve.size())
    if min(fitted(share, False)[0] for share in SETTLES) <= least:
        return 0.0
    return min(fitted(share, True) for share in SETTLES[SETTLES <= 1.0])[1]


def over_speed(curve: Curve, less: Collection[str], laws: Collection[str] = SPEED_LAWS
               ) -> dict[str, np.ndarray]:
    """
    Return what each friction law over speed takes of a curve, of all at once or of some ``laws``.

    ``less`` are those that the servo file has there, and may have too much of.
    """
    speed, top = curve.x, float(np.max(curve.x)) or 1.0
    falls = np.geomspace(0.02, 0.5, BELLS) * top
    tables = {
        'coulomb_friction': np.ones((len(speed), 1)),
        'viscous_friction': speed[:, None] / top,
        'quadratic_drag': (speed[:, None] / top) ** 2,
        'stribeck_friction': np.exp(-(speed[:, None] / falls) ** 2)}
    return _amounts(curve, {law: tables[law] for law in laws}, less)


def nearest_over_speed(curve: Curve, less: Collection[str]) -> str:
    """Return the name of the law over speed that holds most of a curve by itself."""
    return min(SPEED_LAWS, key=lambda law: curve.size(
        curve.y - over_speed(curve, less, (law,))[law]))


def over_load(curve: Curve, less: Collection[str]) -> dict[str, np.ndarray]:
    """Return what of a curve over the load is there without any, and what grows with it."""
    share = np.abs(curve.x) / (float(np.max(np.abs(curve.x))) or 1.0)
    return _amounts(curve, {
        'coulomb_friction': np.ones((len(share), 1)),
        'load_dependent_friction': share[:, None] ** GROWTH}, less)


def _amounts(curve: Curve, tables: dict[str, np.ndarray], less: Collection[str]
             ) -> dict[str, np.ndarray]:
    """Return what each of some laws takes of a curve: what resists, or of ``less`` too much."""
    signs = {name: (1.0, -1.0)[:1 + (name in less)] for name in tables}
    table = np.hstack([sign * some for name, some in tables.items() for sign in signs[name]])
    sure = np.sqrt(curve.density) / np.hypot(curve.high - curve.low, 0.02 * curve.size())
    amounts, _ = nnls(table * sure[:, None], curve.y * sure)
    found, at = {}, 0
    for name, some in tables.items():
        found[name] = np.zeros(len(curve.y))
        for sign in signs[name]:
            found[name] += sign * some @ amounts[at:at + some.shape[1]]
            at += some.shape[1]
    return found
