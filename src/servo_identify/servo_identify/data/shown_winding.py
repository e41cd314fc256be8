r"""
What the drive shows in each recording: resistance, back EMF, and the zero of the current.

.. math::
    K_v u &= R_r\,(i - i_r) + k_r\,\omega + L\,\dot i + u_0\,\mathrm{sgn}\,i \\
    i - i_r &= K_r u

with R, k, K and the zero i of each recording alone. A motor that warms up changes both: copper
gains 0.39 % of its resistance for each degree, and magnets lose some 0.1 to 0.2 % of their field.
What a bridge loses hangs on the motion, so that only recordings of one motion are held against
each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp

import numpy as np
from scipy.stats import chi2

from servo_twin.physics.servo import Servo

from .finding import Finding
from .mistakes import MISTAKE
from .pooled import Columns, Pooled, pooled
from .rough_balances import balances, RoughBalance
from .signals import Signals

LEAST = 0.02  # of a value, by which it differs where a few degrees do it
ONE_MOTION = 1.2  # times as fast as another, up to which a recording is one of the same motion
Told = tuple[str, Signals]


@dataclass(frozen=True)
class _Value:
    """A value of each recording: its column in the fit, and whether it is a zero."""

    what: str
    unit: str
    column: int
    action: str
    zero: bool = False


_ZERO = ('zero of the current, or of the command,', 'A',
         'measure the zero before each recording, and subtract it in the mapping: offset')
_OF_WINDING = (
    _Value('resistance of the winding', 'ohm', 0,
           'let the motor warm up before the first recording, or give drive.resistance a '
           'tolerance as wide'),
    _Value('back EMF of the motor', 'V s/rad', 1,
           'let the motor warm up before the first recording; the torque constant changes with '
           'it'),
    _Value(*_ZERO[:2], 2, _ZERO[2], True))
_OF_LOOP = (_Value(*_ZERO[:2], 1, _ZERO[2], True),)
_VALUES = {'voltage_drive': _OF_WINDING, 'current_drive': _OF_LOOP, 'current_amplifier': _OF_LOOP}
"""What recordings show of each drive of which command and current tell."""


def winding_findings(families: Mapping[str, Sequence[Told]], servo: Servo,
                     sure: float) -> list[Finding]:
    """
    Return what of the drive surely differs between recordings of a family.

    ``families`` holds the names and smoothed channels of recordings by their family; ``sure``,
    nats, is by how much a difference must beat chance, its rarity counted.
    """
    fits = {family: fit for family, several in families.items() if family and len(several) > 1
            and servo.drive.name in _VALUES and (fit := _fit(several, servo))}
    found = []
    for value in _VALUES.get(servo.drive.name, ()):
        told = {family: said for family, fit in fits.items() if (said := _said(
            fit, value, [name for name, _ in families[family]], servo, sure))}
        if told:
            first, *more = told
            found.append(Finding('amber', f'The {value.what} differs between recordings of '
                                 f'{first}: {told[first]}' + (
                                     f'; so it does in {" and ".join(more)}.' if more else '.'),
                                 value.action))
    return found


def _fit(several: Sequence[Told], servo: Servo) -> Pooled | None:
    """Return the fit of a family; None where the channels do not allow it in all recordings."""
    tables = [next((each for each in balances(at, servo) if each.name == 'drive'), None)
              for _, at in several]
    told = [one for one in tables if one]
    fast = [max(float(np.std(speed)) for speed in at.speed.values()) for _, at in several
            if at.speed]
    alike = len(fast) == len(tables) and max(fast) < ONE_MOTION * min(fast)
    return pooled([_columns(one) for one in told]) if alike and len(told) == len(tables) else None


def _columns(balance: RoughBalance) -> Columns:
    """Return the columns of a drive: the current is the factor of the resistance, or is seen."""
    own = [one.column for one in balance.terms.values()] + [np.ones_like(balance.seen)]
    current = balance.terms.get('resistance')
    if current is None:
        return Columns(balance.seen, balance.free[:, :0], np.stack(own, 1))
    sign = np.tanh(current.column / max(float(np.std(current.column)), 1e-300))
    return Columns(balance.seen, np.stack([np.gradient(current.column), sign], 1),
                   np.stack(own, 1))


def _said(fit: Pooled, value: _Value, names: Sequence[str], servo: Servo, sure: float) -> str:
    """Return by how much a value differs, '' where chance may have done it."""
    # the constant of a winding is its resistance times a zero that is read too high
    per = -1.0 / float(np.mean(fit.own[:, 0])) if value.zero and value.column == 2 else 1.0
    own, (apart, covariance) = per * fit.own[:, value.column], fit.apart(
        np.eye(fit.own.shape[1])[value.column])
    low, high = int(np.argmin(own)), int(np.argmax(own))
    if not np.isfinite(covariance).all() or not covariance.any():
        return ''
    far = float(own[high] - own[low])
    least = (np.nan_to_num(servo.noise('current')) if value.zero else LEAST * abs(own[low]))
    wald = float(apart @ np.linalg.pinv(covariance, 1e-9, True) @ apart)
    if far < least or chi2.sf(wald, len(own) - 1) >= exp(-sure - MISTAKE):
        return ''
    pair = np.zeros(len(own))
    pair[[low, high]] = -1.0, 1.0
    error = abs(per) * float(np.sqrt(pair @ covariance @ pair))
    if value.zero:
        return f'{names[high]} has {far:.3g} +- {error:.1g} {value.unit} more than {names[low]}'
    return (f'{own[low]:.4g} {value.unit} in {names[low]}, {own[high]:.4g} +- {error:.1g} in '
            f'{names[high]}')
