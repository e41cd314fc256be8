r"""
What differs between recordings of one motion: the zero of a torque sensor, or friction.

A torque balance is fitted to all recordings of a family at once. Inertia, gravity and how
friction goes with speed are shared; a constant torque and a Coulomb torque are of each recording
alone. They are compared at the speeds that all of them have: between others the curve of friction
over the speed would stand for the difference. What a rough equation lacks is the same in all of
them where they repeat one motion. Recordings that name no family are of one motion where they are
about as fast; of others only the zeros are compared. Where friction is further apart at the
largest of these speeds, it is told there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import spearmanr

from servo_twin.physics.servo import Servo

from .apart import Chance, Difference, most_apart
from .finding import Finding, listed
from .likelihood import SAMPLES
from .pooled import Columns, Pooled, pooled
from .rough_balances import balances, GIVEN, RoughBalance
from .shown_winding import ONE_MOTION
from .signals import Signals

COULOMB, VISCOUS = 'Coulomb friction', 'viscous friction'
FRICTION = {'sensor': 'friction of the motor', 'load': 'friction of the load',
            'torque': 'friction'}
UNHELD = ('. A servo file holds friction that goes with the temperature (friction_drift, '
          'viscous_drift): record that; of any other a diagnosis says in which recording it is')
WARM = 'let the machine warm up before the first recording'
FALLS = -0.8  # rank correlation with the order of the recordings from which on friction falls
TARE = 'tare the sensor before each recording, or subtract its zero in the mapping: offset'
ENDS = (0.05, 0.95)  # quantiles of the speeds of a recording, between which it has them
STRETCHES = 10  # of a recording, each of which may pull a value its own way
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


def _of_family(family: str, several: Sequence[Told], servo: Servo, sure: float) -> list[Finding]:
    motions = [several] if family else _motions(several)
    found = [one for motion in motions if len(motion) > 1
             for one in _of_friction(family, motion, servo, sure)]
    return found + _of_zeros(family, several, servo, sure)


def _motions(several: Sequence[Told]) -> list[list[Told]]:
    """Return recordings that name no family by their motion: those that are about as fast."""
    speed = [max((float(np.std(one)) for one in at.speed.values()), default=0.0)
             for _, at in several]
    motions: list[list[int]] = []
    for k in np.argsort(speed, kind='stable').tolist():
        if motions and speed[k] <= ONE_MOTION * speed[motions[-1][0]]:
            motions[-1].append(k)
        else:
            motions.append([k])
    return [[several[k] for k in sorted(motion)] for motion in motions]


def _balances(several: Sequence[Told], servo: Servo) -> dict[str, list[RoughBalance]]:
    """Return the balances that show friction and that all recordings have at common speeds."""
    tables = [{one.name: one for one in balances(at, servo)} for _, at in several]
    found = {}
    for name in FRICTION:
        if not all(name in table and COULOMB in table[name].terms for table in tables) or (
                name == 'torque' and all('load' in table for table in tables)):
            continue
        alike = _at_common_speeds([table[name] for table in tables])
        if alike:
            found[name] = alike
    return found


def _of_friction(family: str, several: Sequence[Told], servo: Servo, sure: float) -> list[Finding]:
    found, names = [], [name for name, _ in several]
    for name, alike in _balances(several, servo).items():
        fit = _fit(alike)
        shaft = _shaft(name)
        doubt = _of_scale(alike) if name == 'sensor' else np.zeros(len(alike))
        told = _friction(alike, fit, servo.reads('rad/s', shaft),
                         Chance(names, sure, _noise(name, servo), doubt))
        if told:
            near = name == 'load' or servo.values['mechanism.ratio'] == 1.0
            found.append(_finding(
                FRICTION[name], family, told.said(servo.reads('N m', shaft))
                + ('' if near else ', at the motor shaft'),
                _remedy(fit.apart([0.0, 1.0])[0], names) + UNHELD))
    return found


def _of_zeros(family: str, several: Sequence[Told], servo: Servo, sure: float) -> list[Finding]:
    zeros, names = [], [name for name, _ in several]
    for name, alike in _balances(several, servo).items():
        if name == 'torque':  # without a sensor a constant is a torque or an angle of gravity
            continue
        zero = most_apart(*_fit(alike).apart([1.0, 0.0]), Chance(
            names, sure, _noise(name, servo), np.zeros(len(alike))))
        ratio = servo.values['mechanism.ratio'] if name == 'sensor' else 1.0
        zeros.append(zero.said(servo.reads('N m', _shaft(name)), ratio) if zero else '')
    if not any(zeros):
        return []
    which = ('zero of torque, or of current,' if not zeros[-1] else
             'zero of torque' if all(zeros) and len(zeros) > 1 else
             'zero of torque, or a constant torque at the load,')
    return [_finding(which, family, zeros[-1] or zeros[0], TARE)]


def _shaft(balance: str) -> str:
    return 'load_position' if balance == 'load' else 'motor_position'


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
    return pooled(columns, STRETCHES)


def _friction(several: Sequence[RoughBalance], fit: Pooled, per: str,
              chance: Chance) -> Difference | None:
    """
    Return how far friction is apart, at the largest speed where it is further apart there.

    Friction that drifts with its slope differs there by more than it does on the mean.
    """
    mean = most_apart(*fit.apart([0.0, 1.0]), chance)
    fast = max(float(np.abs(one.terms[VISCOUS].column).max()) for one in several)
    at_it = replace(chance, where=f' at {fast:.3g} {per}')
    end = most_apart(*_fit(several, sloped=True).apart([0.0, 1.0, fast]), at_it)
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
            'a bearing, a machine that was cold, or a motion or a load that the others lack')


def _of_scale(several: Sequence[RoughBalance]) -> np.ndarray:
    """
    Return what a torque constant that is off makes of the Coulomb torques, (recordings,).

    The balance at the torque sensor is a small difference of two torques. One that grows, as by
    friction of the load, leaves of itself what the scale between them is off.
    """
    return np.array([GIVEN * np.linalg.lstsq(
        np.stack([np.ones_like(one.seen), one.terms[COULOMB].column], 1), one.seen,
        rcond=None)[0][1] for one in several])
