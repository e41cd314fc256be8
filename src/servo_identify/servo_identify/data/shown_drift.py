r"""
What differs between recordings of one motion: the zero of a torque sensor, or friction.

A torque balance is fitted to all recordings of a family at once. Inertia, gravity and how
friction goes with speed are shared; a constant torque and a Coulomb torque are of each recording
alone. They are compared at the speeds that all of them have: between others the curve of friction
over the speed would stand for the difference. What a rough equation lacks is the same in all of
them, since they repeat one motion. Where friction is further apart at the largest of these speeds,
it is told there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp

import numpy as np
from scipy.stats import chi2, spearmanr

from servo_twin.physics.servo import Servo

from .finding import Finding, listed
from .likelihood import SAMPLES
from .mistakes import MISTAKE
from .pooled import Columns, Pooled, pooled
from .rough_balances import balances, GIVEN, RoughBalance
from .signals import Signals

COULOMB, VISCOUS = 'Coulomb friction', 'viscous friction'
FRICTION = {'sensor': 'friction of the motor', 'load': 'friction of the load',
            'torque': 'friction'}
UNHELD = '; a diagnosis names such friction, and no servo file holds it'
WARM = 'let the machine warm up before the first recording'
FALLS = -0.8  # rank correlation with the order of the recordings from which on friction falls
TARE = 'tare the sensor before each recording, or subtract its zero in the mapping: offset'
ENDS = (0.05, 0.95)  # quantiles of the speeds of a recording, between which it has them
FORMS = (0.5, 2.0)  # powers of the speed beside the first, for a friction of any form
Told = tuple[str, Signals]


def drift_findings(families: Mapping[str, Sequence[Told]], servo: Servo,
                   sure: float) -> list[Finding]:
    """
    Return what surely differs between the recordings of a family.

    ``families`` holds the names and smoothed channels of recordings by their family; ``sure``,
    nats, is by how much a difference must beat chance, its rarity counted.
    """
    return [finding for family, several in families.items() if len(several) > 1
            for finding in _of_family(family, several, servo, sure)]


@dataclass(frozen=True)
class _Chance:
    """
    What may make recordings differ: chance, below ``sure``, the ``noise`` of a reading, a doubt.

    ``doubt`` is by what they may be off together, (recordings,). ``where`` the values hold.
    """

    names: Sequence[str]
    sure: float
    noise: float
    doubt: np.ndarray
    where: str = ''


@dataclass(frozen=True)
class _Difference:
    """By how much the value of one recording is above that of another."""

    far: float
    error: float
    low: str
    high: str
    where: str

    def said(self, unit: str, scale: float = 1.0) -> str:
        """Say it, times ``scale``, which brings it to where it is read."""
        return (f'{self.high} has {scale * self.far:.3g} +- {scale * self.error:.1g} {unit} more '
                f'than {self.low}{self.where}')


def _of_family(family: str, several: Sequence[Told], servo: Servo, sure: float) -> list[Finding]:
    tables = [{one.name: one for one in balances(at, servo)} for _, at in several]
    names = [name for name, _ in several]
    found, zeros = [], []
    for name in FRICTION:
        if not all(name in table and COULOMB in table[name].terms for table in tables) or (
                name == 'torque' and all('load' in table for table in tables)):
            continue
        alike = _at_common_speeds([table[name] for table in tables])
        if not alike:
            continue
        fit = _fit(alike)
        shaft = 'load_position' if name == 'load' else 'motor_position'
        unit, ratio = servo.reads('N m', shaft), servo.values['mechanism.ratio']
        chance = _Chance(names, sure, _noise(name, servo), np.zeros(len(alike)))
        doubtful = replace(chance, doubt=_of_scale(alike)) if name == 'sensor' else chance
        told = _friction(alike, fit, servo.reads('rad/s', shaft), doubtful)
        if told:
            where = '' if name == 'load' or ratio == 1.0 else ', at the motor shaft'
            found.append(_finding(FRICTION[name], family, told.said(unit) + where,
                                  _remedy(fit.apart([0.0, 1.0])[0], names) + UNHELD))
        if name != 'torque':  # without a sensor a constant is a torque or an angle of gravity
            zero = _told(*fit.apart([1.0, 0.0]), chance)
            zeros.append(zero.said(unit, ratio if name == 'sensor' else 1.0) if zero else '')
    if any(zeros):
        which = ('zero of torque, or of current,' if not zeros[-1] else
                 'zero of torque' if all(zeros) and len(zeros) > 1 else
                 'zero of torque, or a constant torque at the load,')
        found.append(_finding(which, family, zeros[-1] or zeros[0], TARE))
    return found


def _finding(what: str, family: str, told: str, action: str) -> Finding:
    of = f' of {family}' if family else ''
    return Finding('amber', f'The {what} differs between recordings{of}: {told}.', action)


def _noise(name: str, servo: Servo) -> float:
    """Return the noise of a single reading in a balance, N m or N; 0 where it is not given."""
    motor = servo.values['drive.torque_constant'] * servo.noise('current')
    sensor = servo.noise('torque') / (servo.values['mechanism.ratio'] if name == 'sensor' else 1.0)
    used = {'torque': (motor,), 'sensor': (motor, sensor), 'load': (sensor,)}[name]
    return float(np.linalg.norm(np.nan_to_num(used)))


def _at_common_speeds(several: Sequence[RoughBalance]) -> list[RoughBalance]:
    """Return the samples at speeds that all recordings have; none where they have none."""
    speeds = [np.abs(one.terms[VISCOUS].column) for one in several]
    ends = np.array([np.quantile(speed, ENDS) for speed in speeds])
    low, high = ends[:, 0].max(), ends[:, 1].min()
    rows = [(speed >= low) & (speed <= high) for speed in speeds]
    return [_of_rows(one, kept) for one, kept in zip(several, rows, strict=True)] if min(
        int(kept.sum()) for kept in rows) > SAMPLES else []


def _of_rows(one: RoughBalance, rows: np.ndarray) -> RoughBalance:
    terms = {name: replace(term, column=term.column[rows]) for name, term in one.terms.items()}
    return replace(one, seen=one.seen[rows], terms=terms, free=one.free[rows])


def _fit(several: Sequence[RoughBalance], sloped: bool = False) -> Pooled:
    """
    Return the fit with a constant and a Coulomb torque of each recording.

    ``sloped``: with what friction rises by over the speed of each as well.
    """
    columns = []
    for one in several:
        speed, sign = np.abs(one.terms[VISCOUS].column), one.terms[COULOMB].column
        shared = [term.column for name, term in one.terms.items()
                  if name != COULOMB and not (sloped and name == VISCOUS)]
        shared += [sign * speed**power for power in FORMS]
        own = [np.ones_like(one.seen), sign, *([one.terms[VISCOUS].column] if sloped else [])]
        columns.append(Columns(one.seen, np.column_stack([*shared, one.free[:, 1:]]),
                               np.stack(own, 1)))
    return pooled(columns)


def _friction(several: Sequence[RoughBalance], fit: Pooled, per: str,
              chance: _Chance) -> _Difference | None:
    """
    Return how far friction is apart, at the largest speed where it is further apart there.

    Friction that drifts with its slope differs there by more than it does on the mean.
    """
    mean = _told(*fit.apart([0.0, 1.0]), chance)
    fast = max(float(np.abs(one.terms[VISCOUS].column).max()) for one in several)
    at_it = replace(chance, where=f' at {fast:.3g} {per}')
    end = _told(*_fit(several, sloped=True).apart([0.0, 1.0, fast]), at_it)
    return end if mean and end and end.far - end.error > mean.far else mean


def _remedy(friction: np.ndarray, names: Sequence[str]) -> str:
    """Return what to do about friction that differs so, (recordings,), in their order."""
    order = spearmanr(np.arange(len(friction)), friction).statistic if len(names) > 2 else 0.0
    if order < FALLS:
        return WARM
    more = friction > (friction.min() + friction.max()) / 2.0
    few = more if 2 * more.sum() <= len(more) else ~more
    those = listed([name for name, one in zip(names, few, strict=True) if one])
    return (f'look for what drags in {"" if few is more else "all but "}{those}: a brake, a seal, '
            'a bearing, or a machine that was cold')


def _of_scale(several: Sequence[RoughBalance]) -> np.ndarray:
    """
    Return what a torque constant that is off makes of the Coulomb torques, (recordings,).

    The balance at the torque sensor is a small difference of two torques. One that grows, as by
    friction of the load, leaves of itself what the scale between them is off.
    """
    return np.array([GIVEN * np.linalg.lstsq(
        np.stack([np.ones_like(one.seen), one.terms[COULOMB].column], 1), one.seen,
        rcond=None)[0][1] for one in several])


def _told(apart: np.ndarray, covariance: np.ndarray, chance: _Chance) -> _Difference | None:
    """Return the largest difference of values with their covariance, None if it may be chance."""
    together = chance.doubt - np.mean(chance.doubt)
    covariance = covariance + np.outer(together, together)
    if not np.isfinite(covariance).all() or not covariance.any():
        return None
    spread = float(apart @ np.linalg.pinv(covariance, 1e-9, True) @ apart)
    low, high = int(np.argmin(apart)), int(np.argmax(apart))
    pair = np.zeros(len(apart))
    pair[[low, high]] = -1.0, 1.0
    far, error = float(pair @ apart), float(np.sqrt(pair @ covariance @ pair))
    if far < chance.noise or chi2.sf(spread, len(apart) - 1) >= exp(-chance.sure - MISTAKE):
        return None
    return _Difference(far, error, chance.names[low], chance.names[high], chance.where)
