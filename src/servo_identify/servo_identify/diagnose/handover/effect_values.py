"""Mechanisms whose amplitudes in the equations are values of their effect in the twin."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.optimize import nnls

from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed, Value

from ..decisions import FORM, WORTH
from ..mechanisms.hypothesis import Hypothesis
from .curves import Curve, Part
from .laws import Formed, of_orders

SUDDEN = 1e-3  # half widths beyond a threshold within which a command counts in full
MEAN = 0.625
"""Travel by which an element of hysteresis slips on the average, as a share of the last one's."""


def by_orders(part: Part, one: Hypothesis) -> list[Formed]:
    """Return the waves of a periodic mechanism that are worth it as effects; else none."""
    knots = np.asarray(one.knots, dtype=float) if one.form is not None and one.knots and all(
        isinstance(k, int | float) for k in one.knots) else np.zeros(0)
    names = ('cogging', 'torque_ripple', 'transmission_error', 'position_dependent_backlash',
             'position_dependent_friction', 'torque_sensor_offset', 'motor_encoder_eccentricity')
    if part.mechanism.name not in names or one.detail.get('form') == 'curve' or (
            len(knots) != len(part.amplitudes)) or one.tried < 2:
        return []
    order = np.argsort(knots, kind='stable')
    at = [k for k in order if knots[k] > 0.0]
    if len(at) % 2:
        return []
    law = one.detail.get('law', part.mechanism.name)
    size = np.hypot(part.amplitudes[at][::2], part.amplitudes[at][1::2])
    there = np.repeat(size > WORTH * size.max(), 2)
    return of_orders(find(law), tuple(knots[at][there]), part.amplitudes[at][there])


def wave_stds(curve: Curve | None, placed: Sequence[Placed],
              values: Mapping[str, Value]) -> dict[str, float]:
    """
    Return the standard deviations of the amplitudes of waves, by name, from their curve's band.

    ``values`` by path. Those of cosine and sine are alike, and those of all multiples.
    """
    found: dict[str, float] = {}
    if curve is None or not curve.size():
        return found
    share = curve.doubt()
    for one in placed:
        rows = {path: np.atleast_1d(values[path]) for path in (
            f'effects.{one.name}.{name}' for name in ('cosine', 'sine')) if path in values}
        whole = np.sqrt(sum(float(row @ row) for row in rows.values()))
        found |= {f'{path}[{k}]': float(share * whole / np.sqrt(2.0))
                  for path, row in rows.items() for k in range(len(row))}
    return found


def scale_std(curve: Curve | None, placed: Sequence[Placed],
              values: Mapping[str, Value], free: Sequence[str]) -> dict[str, float]:
    """
    Return the standard deviation of the one value that a curve grows with, by path.

    Of a law with a shape as well nothing is returned: the band of the curve does not split it.
    """
    amplitudes = [f'effects.{one.name}.{name}' for one in placed
                  for name in one.effect.amplitudes()]
    value = values[free[0]] if len(free) == 1 and free[0] in amplitudes else None
    if curve is None or not curve.size() or not isinstance(value, float):
        return {}
    std = abs(value) * curve.doubt()
    return {free[0]: float(std)} if std > 0.0 else {}


SHAPED: dict[str, Callable[[Hypothesis, np.ndarray], dict[str, float]]] = {
    'eddy_brake': lambda one, a: {'peak': float(a[0]), 'speed': float(one.knots[0])},
    'sensor_lag': lambda one, a: {'lag': float(a[0] * one.knots[0])},
    'command_rate_limit': lambda one, a: {'rate': float(one.knots[0])},
    'torque_speed_limit': lambda one, a: {'limit': float(one.knots[0]),
                                          'slope': float(one.detail['slope'])},
    'braking_power_limit': lambda one, a: {'power': float(one.knots[0])},
    'torque_sensor_inertia': lambda one, a: {'inertia': float(a[0])},
    'relaxing_spring': lambda one, a: {'stiffness': float(a[0]), 'time': float(one.knots[0])},
    'viscoelasticity': lambda one, a: {  # and by how much more it is so at once
        'stiffness': one.detail['stiffness'] * (1.0 / max(
            1.0 - one.detail['stiffness'] * float(a[0]), FORM) - 1.0),
        'time': float(one.knots[0])},
    'payload_resonance': lambda one, a: {'inertia': float(a[0]), 'frequency': float(one.knots[0]),
                                         'damping': float(one.detail['damping'])}}
"""Values of effects with one amplitude and a shape that was sought."""


def direct(part: Part, one: Hypothesis) -> Formed | None:
    """Return a mechanism whose amplitudes are the values of its effect."""
    name, a = part.mechanism.name, part.amplitudes
    fixed: dict[str, Value] = {}
    law = True
    if name in ('gravity', 'load_encoder_eccentricity') and len(a) == 2:
        values = {'cosine': float(a[0]), 'sine': float(a[1])}
        if name != 'gravity' and one.knots:
            fixed = {'order': float(one.knots[0])}
    elif name in ('current_sensor_offset', 'torque_sensor_offset'):
        values = {'offset': float(np.mean(part.curve.y if part.curve is not None else a))}
        law = part.curve is None
    elif name in ('current_sensor_gain', 'torque_sensor_gain'):
        values, law = _gain(part)
    elif name in ('sensor_delay', 'command_delay'):
        values = {'delay': float(np.asarray(one.knots or (1.0,)) @ a)}
    elif name == 'current_lag':
        values = {'lag': float(np.asarray(one.knots) @ a)}
    elif name in SHAPED:
        values = SHAPED[name](one, a)
    elif one.detail.get('law') == 'dahl_hysteresis':  # lost angle as torque
        stiffness, lost = one.detail['stiffness'], float(a[0])
        values = {'level': stiffness * lost, 'travel': _slips(one.knots[0], lost, stiffness)}
    elif name in ('hysteresis', 'torque_sensor_hysteresis') and one.detail.get('form') != 'curve':
        return _loops(part, one)
    elif name == 'backlash':
        values = {'width': float(a[0]) if part.curve is None else float(part.curve.y[-1])}
    elif one.detail.get('law') == 'drive_dead_time':
        values = _lost(a / one.detail['resistance'], np.asarray(one.knots))
        fixed = {'settling': one.detail['settling']}
    elif one.detail.get('opens') and abs(a.sum() - 1.0) <= FORM:  # then with all of the command
        values, fixed = {'half_width': float(a @ one.knots / a.sum())}, {'regain': SUDDEN}
    elif name == 'supply_sag':
        values = dict(zip(('drop', 'slow'), map(float, a), strict=False))
        fixed = dict(zip(('settling', 'resistance', 'back_emf'), one.knots, strict=False)) | dict(
            one.detail)
    elif one.detail.get('law') == 'one_sided_stiffness':  # what is lost of an angle, as torque
        values = {'difference': -one.detail['stiffness'] ** 2 * float(a[0])}
    elif one.detail.get('law') == 'current_limit' and part.curve is not None:
        last = int(np.argmax(part.curve.x))
        values = {'limit': float(part.curve.x[last] + part.curve.y[last])}
    elif one.detail.get('law') == 'dahl_friction':
        values = {'level': float(a[0]), 'travel': float(one.knots[0])}
    elif name == 'load_dependent_friction' and 'law' in one.detail:
        values = _driven_back(*map(float, a))
    else:
        return None
    effect = find(one.detail.get('law', name))
    whole = {n: p.default for n, p in effect.parameters.items()} | values | fixed
    return Formed(effect, whole, tuple(values), law)


def warms(one: Hypothesis) -> bool:
    """Tell whether a friction follows a temperature, by its last amplitude."""
    searched = one.mechanism.name == 'friction_drift' and one.tried > 1
    return searched or one.detail.get('span', 0.0) > 0.0


def warmed(part: Part, one: Hypothesis, timed: Formed | None) -> Formed:
    """
    Return friction that follows a temperature, the last amplitude.

    ``timed`` is what of it fades with the time besides, where that is worth it.
    """
    effect = find(one.detail.get('law', part.mechanism.name))
    searched = one.tried > 1
    thinning, mean = one.knots if searched else (0.0, one.detail['mean'])
    slope = -float(part.amplitudes[-1]) / (1.0 if searched else one.detail['span'])
    values: dict[str, Value] = {n: p.default for n, p in effect.parameters.items()}
    fading = {'excess': 0.0} if timed is None else timed.values
    free = () if timed is None else timed.free
    thins: dict[str, Value] = {'thinning': float(thinning)} if searched else {}
    return Formed(effect, values | fading | {'slope': slope, 'reference': float(mean)} | thins,
                  (*free, 'slope', *thins), timed is None or timed.law)


def _driven_back(driving: float, driven: float) -> dict[str, float]:
    """
    Return shares of the torque on the teeth from shares of what the load asks for.

    The teeth carry the friction too where the motor drives, and less by it where the load does.
    """
    share = driving / (1.0 + driving)
    return {'share': share, 'back_driven': max(0.0, driven / max(1.0 - driven, FORM) - share)}


def _gain(part: Part) -> tuple[dict[str, float], bool]:
    """Return the excess of a reading in proportion, and whether that is all of it."""
    if part.curve is None:
        return {'excess': float(part.amplitudes[0])}, True
    if part.curve.variable == 'time':
        return {'excess': part.curve.mean()}, False
    excess = part.curve.slope()
    left = part.curve.y - excess * part.curve.x
    return {'excess': excess}, part.curve.size(left) <= FORM * part.curve.size()


def one_way(curve: Curve, way: float) -> list[Formed]:
    """
    Return friction that one direction has alone: as much in both, and the difference.

    The curve is taken for a level and what grows with speed, both at least zero.
    """
    table = np.column_stack((np.ones(len(curve.x)), curve.x))
    weight = np.sqrt(curve.density)[:, None]
    (level, slope), _ = nnls(weight * table, weight[:, 0] * curve.y)
    left = curve.size(curve.y - table @ (level, slope))
    law = left <= FORM * curve.size()
    level, slope = 0.5 * float(level), 0.5 * float(slope)
    several: dict[str, dict[str, float | tuple[float, ...]]] = {
        'asymmetric_friction': {'difference': way * level, 'slope': way * slope},
        'coulomb_friction': {'level': level}, 'viscous_friction': {'slope': slope}}
    return [Formed(find(name), values, tuple(values), law)
            for name, values in several.items() if any(values.values())]


def _lost(losses: np.ndarray, knees: np.ndarray) -> dict[str, float]:
    """
    Return what a bridge loses of a current, and from which current that is all, A.

    ``losses`` build up over ``knees`` of the current that would flow without them. By the slope
    at rest, where a share of it flows all the same.
    """
    loss = float(losses.sum())
    slope = float(losses @ (1.0 / knees))
    return {'loss': loss, 'rounding': max(loss / slope - loss, 0.0) if slope > 0.0 else 0.0}


def _loops(part: Part, one: Hypothesis) -> Formed:
    """Return hysteresis of a reading, or over torsion from the angle lost over torque."""
    stiffness = float(one.detail.get('stiffness', 1.0))
    sizes = np.abs(part.amplitudes)
    whole = float(sizes.sum())
    mean = float(sizes @ np.asarray(one.knots)) / max(whole, 1e-300)
    slips = _slips(mean, whole, stiffness) if 'stiffness' in one.detail else mean
    return Formed(find(part.mechanism.name),
                  {'level': stiffness * float(part.amplitudes.sum()),
                   'travel': max(slips / MEAN, 1e-9)}, ('level', 'travel'), True)


def _slips(torque: float, lost: float, stiffness: float) -> float:
    r"""
    Return the torsion, rad, by which elements slip that lose an angle over a torque.

    .. math:: d = w / K - a

    ``torque`` is w, the torque by which they slip, N m; ``lost`` is a, rad. Until they slip they
    are a spring of K a / d beside the ``stiffness`` K, so that less than w / K is needed. Of
    several elements it holds for the means: as much energy goes into each loop.
    """
    return max(torque / stiffness - lost, FORM * torque / stiffness)
