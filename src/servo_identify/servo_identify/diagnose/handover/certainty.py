"""How sure the values of missing effects are, and the file that says so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
import re

import numpy as np

from servo_twin.physics.servo import Provenance, Servo
from servo_twin.recording.recording import Recording

from ...fit.estimate import Estimate
from ...fit.free_values import SURE
from .added import Added

SOURCE = 'gap diagnosis'

SENSOR_GAIN = 'torque_sensor_gain'

TORQUE = re.compile(r'\bN\b|\bkg\b')
"""Units of what grows with all torques alike: torques and forces, inertias, stiffnesses."""


def torque_scale(servo: Servo, recordings: Sequence[Recording],
                 several: Sequence[Added] = ()) -> float:
    """
    Return how sure the common factor of all torques is, a relative standard deviation.

    Twice the torques, inertias and torque constant move a shaft alike. Without a torque that is
    measured the tolerances of the servo file alone tell that factor; 0.0 where one is, or where a
    value is exact. A sensor whose gain is one of the missing effects (``several``) tells none.
    """
    told = {'torque', 'external_torque'}
    told -= {placed.site for one in several for placed in one.placed
             if placed.effect.name == SENSOR_GAIN}
    if any(np.any(np.nan_to_num(one[name])) for one in recordings for name in told):
        return 0.0
    known = 0.0
    for path, value in servo.numbers.items():
        if path.startswith(('sensors.', 'controller.')) or not value or not TORQUE.search(
                servo.unit(path)):
            continue
        low, high = servo.tolerance.get(path, (value, value))
        if high <= low and path.startswith(('drive.', 'mechanism.')):
            return 0.0
        if high > low:
            known += (SURE * value / (0.5 * (high - low)))**2
    return 1.0 / np.sqrt(known) if known else 0.0


def spread(several: Sequence[Added], joint: Estimate, scale: float = 0.0) -> dict[str, float]:
    """
    Return the standard deviations of a fit, at least half of what the equations say otherwise.

    A fit counts noise alone. Where the form is not quite right, equations and simulation weigh
    the misfit differently, and neither is surer than they agree. No torque is surer than the
    ``scale`` of all; see :func:`torque_scale`.
    """
    known = {path: value for one in several for path, value in one.values.items()}
    spread = {}
    for name, std in joint.std_within.items():
        path, _, index = name.partition('[')
        apart = 0.0
        if path in known and path in joint.servo.values:
            there, here = np.atleast_1d(known[path]), np.atleast_1d(joint.servo.values[path])
            k = int(index.rstrip(']')) if index else 0
            if len(there) == len(here) and k < len(here):
                apart = 0.5 * abs(float(here[k] - there[k]))
        grows = _torques(path, joint.values[name], joint.units[name])
        spread[name] = max(std, apart, scale * grows)
    return spread


def held_spread(several: Sequence[Added], servo: Servo, scale: float) -> dict[str, float]:
    """
    Return the standard deviations of values that are held at what the equations say, by name.

    ``servo`` has them. No torque is surer than the ``scale`` of all.
    """
    found = {}
    for one in several:
        for name, std in one.stds.items():
            path, _, index = name.partition('[')
            if path in one.held:
                row = np.atleast_1d(servo.values[path])
                value = float(row[int(index.rstrip(']')) if index else 0])
                found[name] = max(std, scale * _torques(path, value, servo.unit(path)))
    return found


def _torques(path: str, value: float, unit: str) -> float:
    """Return what of a value grows with all torques alike, in its ``unit``: all of it or none."""
    if path.endswith('.excess') and SENSOR_GAIN in path:
        return abs(1.0 + value)
    return abs(value) if TORQUE.search(unit) else 0.0


def within_spread(several: Sequence[Added], joint: Estimate) -> dict[str, tuple[float, float]]:
    """Return between what the free values of effects lie, by path, each of a row by its number."""
    std, found = spread(several, joint), {}
    for path in (path for one in several for path in one.fitted):
        values, row = joint.servo.values[path], isinstance(joint.servo.values[path], tuple)
        for k, value in enumerate(np.atleast_1d(values)):
            name = f'{path}[{k}]' if row else path
            apart = SURE * std.get(name, np.inf)
            found[name] = float(value - apart), float(value + apart)
    return found


def signed(servo: Servo, stds: Mapping[str, float], bags: tuple[str, ...]) -> Servo:
    """Return a servo whose new values say where they come from, and how sure they are."""
    said = dict(servo.provenance)
    for name, std in stds.items():
        path = name.partition('[')[0]
        if path in servo.values and name not in servo.tolerance:
            known = said.get(path)
            worst = max((s for s in (known.std if known and known.source == SOURCE else None, std)
                         if s is not None and np.isfinite(s)), default=None)
            said[path] = Provenance(SOURCE, worst, bags)
    return replace(servo, provenance=said)
