"""
Effects that come with another value of the file: what they take out of it, or its mean.

A stiffness that varies has another mean, part of a load that swings is no longer fixed to it,
friction that builds up is friction that the file has already.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.integrate import trapezoid

from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Servo, Value

from ..decisions import FORM
from ..mechanisms.hypothesis import Hypothesis
from ..mechanisms.orders import waves
from ..residuals.nuisance import FAR
from .curves import Curve, Part
from .effect_values import direct
from .laws import Formed, of_orders

TURN = 4096  # angles of a turn at which a stiffness is taken from its compliance
SETTLES = np.geomspace(0.05, 20.0, 60)  # shares of a recording in which a winding may be warm

Together = tuple[list[Formed], dict[str, float]]
"""Effects, and by how much values of the file are others, by path."""


def with_values(part: Part, one: Hypothesis, servo: Servo) -> Together | None:
    """Return the effects of a part and what comes with them; None where nothing does."""
    law, amplitudes = one.detail.get('law'), part.amplitudes
    if law == 'stiffness_ripple':
        return _rippled(one.knots, amplitudes, one.detail.get('along', (0.0, 2.0 * np.pi)),
                        servo.numbers.get('mechanism.stiffness', np.inf))
    if law == 'linked_inertia':
        lever = servo.numbers['mechanism.ratio'] if part.mechanism.site == 'motor' else 1.0
        return _linked(np.asarray(one.knots), amplitudes, lever)
    if law == 'coupled_inertia':
        mean, cosine, sine = map(float, amplitudes[-3:])
        values: dict[str, Value] = {'cosine': cosine, 'sine': sine, 'order': one.knots[-1]}
        return [Formed(find(law), values, ('cosine', 'sine'), True)], {
            'mechanism.load_inertia': mean - float(np.hypot(cosine, sine))}
    if law == 'payload_resonance':
        swings = direct(part, one)
        assert swings is not None  # its amplitude is a value of it
        return [swings], _taken_out(float(amplitudes[0]), servo)
    if law == 'torque_constant_change' and part.curve is not None:
        return _changing(part, part.curve, one, servo.numbers['drive.torque_constant'])
    if law == 'winding_warmth' and part.curve is not None:
        return _warming(part, part.curve, one, servo)
    if law == 'drive_asymmetry':
        more, by_sign = map(float, amplitudes)
        values = {'difference_by_sign': 2.0 * by_sign / (1.0 + more)}
        return [Formed(find(law), values, tuple(values), True)], {
            'drive.gain': servo.numbers['drive.gain'] * more}
    if part.mechanism.name == 'load_encoder_eccentricity' and len(amplitudes) > 2:
        return [Formed(find(part.mechanism.name), {
            'cosine': float(amplitudes[k]), 'sine': float(amplitudes[k + 1]),
            'order': float(one.knots[k])}, ('cosine', 'sine'), True)
            for k in range(0, len(amplitudes), 2)], {}
    if part.mechanism.name == 'presliding_friction' and law is None:
        return _presliding(part, one, servo)
    return None


def _taken_out(inertia: float, servo: Servo) -> dict[str, float]:
    """Return what an inertia at the load, kg m2, takes out of the load and, rigid, the rotor."""
    load, ratio = servo.numbers['mechanism.load_inertia'], servo.numbers['mechanism.ratio']
    here = inertia if servo.mechanism.compliant else min(inertia, load)
    rotor = servo.numbers['mechanism.rotor_inertia']
    rest = min((inertia - here) / ratio**2, (1.0 - FORM) * rotor)
    taken = {'mechanism.load_inertia': -here}
    return taken | {'mechanism.rotor_inertia': -rest} if rest else taken


def _changing(part: Part, curve: Curve, one: Hypothesis, given: float) -> Together:
    """
    Return what a torque constant changes by over speed or temperature, and the one that is left.

    The one that is left holds at rest, or at the middle of the temperatures.
    """
    y = _values_along(part, curve, one)
    middle, power = (curve.density @ curve.x / curve.density.sum(), 1) if (
        curve.variable == 'temperature') else (0.0, 2)
    x = (curve.x - middle)**power
    weight = np.sqrt(curve.density)
    constant, slope = np.linalg.lstsq(weight[:, None] * np.column_stack((np.ones(len(x)), x)),
                                      weight * y, rcond=None)[0]
    warm = power == 1
    values: dict[str, Value] = {'by_temperature': float(slope) if warm else 0.0,
                                'reference': float(middle) if warm else 20.0,
                                'by_speed': 0.0 if warm else -float(slope)}
    left = curve.size(y - constant - slope * x)
    law = left <= FORM * curve.size(y - given)
    effect = find('torque_constant_change')
    return [Formed(effect, values, ('by_temperature' if warm else 'by_speed',), law)], {
        'drive.torque_constant': float(constant) - given}


def _warming(part: Part, curve: Curve, one: Hypothesis, servo: Servo) -> Together:
    """Return what a resistance rises by with the time, and the one that a run begins with."""
    y, weight, best = _values_along(part, curve, one), np.sqrt(curve.density), np.inf
    for settling in np.ptp(curve.x) * SETTLES:
        table = np.column_stack((np.ones(len(y)), 1.0 - np.exp(-curve.x / settling)))
        found = np.linalg.lstsq(weight[:, None] * table, weight * y, rcond=None)[0]
        left = curve.size(y - table @ found)
        if left < best:
            best, (cold, rise), time = left, found, float(settling)
    given = servo.numbers
    values: dict[str, Value] = {
        'rise': float(rise), 'settling': time, 'resistance': float(cold),
        **{name: given[f'drive.{name}'] for name in ('back_emf', 'gain')}}
    law = best <= FORM * curve.size(y - given['drive.resistance'])
    return [Formed(find('winding_warmth'), values, ('rise', 'settling'), law)], {
        'drive.resistance': float(cold) - given['drive.resistance']}


def _values_along(part: Part, curve: Curve, one: Hypothesis) -> np.ndarray:
    """Return a value of the file where its curve was drawn, in the unit of the value."""
    assert one.form is not None
    return np.vectorize(one.detail['is'])(one.form.shape(curve.x) @ part.amplitudes)


def _rippled(orders: Sequence[float], amplitudes: np.ndarray, along: tuple[float, float],
             stiffness: float) -> Together:
    """
    Return a stiffness that varies over the turn or ``along`` an axis, N m/rad, and its mean.

    ``amplitudes`` rad/(N m) are those of cosine and sine of the compliance, each of one of
    ``orders``; its mean has order 0. Where a compliance varies much, its mean is no measure of
    that of the stiffness.
    """
    each = sorted({order for order in orders if order})
    angle = np.linspace(*along, TURN, endpoint=False)
    table = waves(angle, dict.fromkeys(orders))
    compliance = 1.0 / stiffness + table[:, table.any(axis=0)] @ amplitudes
    stiff = 1.0 / np.maximum(compliance, 1.0 / (FAR * stiffness))
    mean, *rows = np.linalg.lstsq(np.column_stack((np.ones(TURN), waves(angle, each))), stiff,
                                  rcond=None)[0]
    several = of_orders(find('stiffness_ripple'), tuple(np.repeat(each, 2)), np.array(rows))
    return several, {'mechanism.stiffness': float(mean) - stiffness}


def _linked(orders: np.ndarray, amplitudes: np.ndarray, lever: float) -> Together:
    """
    Return an inertia that varies over the turn, and by how much those of the shafts are others.

    ``amplitudes`` kg m2 are those of cosine and sine of each of ``orders`` of the turn of a shaft
    that turns ``lever`` times as fast as the load; its mean has order 0. What varies hangs at the
    load, at which it counts by the square of that, beside the least of it.
    """
    varies = orders > 0.0
    several = of_orders(find('linked_inertia'), tuple(lever * orders[varies]),
                        lever**2 * amplitudes[varies])
    least = lever**2 * float(np.hypot(amplitudes[varies][::2], amplitudes[varies][1::2]).sum())
    mean, changes = float(amplitudes[~varies].sum()), {'mechanism.load_inertia': -least}
    if lever == 1.0:
        changes['mechanism.load_inertia'] += mean
    else:
        changes['mechanism.rotor_inertia'] = mean
    return several, changes


def _presliding(part: Part, one: Hypothesis, servo: Servo) -> Together:
    """
    Return friction that builds up over the travel, LuGre, from what it lacks after a reversal.

    An element that slips after the travel s lacks twice its level, falling over 2 s; a decay what
    it is, over s. A curve lacks what it is more than at its end. What builds up is friction that
    the servo has: it is taken from the Coulomb friction there, which moves with it.
    """
    effect, knots = find('presliding_friction'), np.asarray(one.knots)
    rest = 0.0  # that lacks at any travel
    if one.detail.get('form') == 'curve':
        rest, lack = float(part.amplitudes[-1]), part.amplitudes - part.amplitudes[-1]
        level = max(0.5 * float(lack[0]), 0.0)
        turned = servo.numbers['mechanism.ratio'] if part.mechanism.site == 'motor' else 1.0
        area = turned * float(trapezoid(lack, knots))
    else:
        lacks = part.amplitudes * np.repeat((2.0, 1.0), len(part.amplitudes) // 2)
        level, area = 0.5 * float(lacks.sum()), float(lacks @ knots)
    travel = area / max(2.0 * level, 1e-300)
    values = {n: p.default for n, p in effect.parameters.items()} | {
        'level': level, 'breakaway': max(travel, 1e-8)}
    changes = {}
    for placed in servo.effects:
        path = f'effects.{placed.name}.level'
        if placed.effect.name == 'coulomb_friction' and placed.site == part.mechanism.site:
            changes[path] = max(-level - rest, -servo.numbers[path])
    return [Formed(effect, values, ('level', 'breakaway'), True)], changes
