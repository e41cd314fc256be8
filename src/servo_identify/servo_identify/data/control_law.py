r"""
The factor of a reference by the control law of the servo file, where the command was recorded.

.. math:: u = g\,(A(r) / f + B(\theta)) + z

A law without limits is linear: A is its answer to the reference alone, B to the angles alone. The
gain g of all of it may be off, and so may the zero of its integral. Then f is the factor by which
the reference is off, however well the angle follows. Where the law does not close, as at a limit
or with another firmware, it says nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import NamedTuple

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.state import CONTROLLER_SIZE
from servo_twin.recording.joined_samples import control_values
from servo_twin.recording.recording import Recording

from .mistakes import REFERENCES
from .pooled import Columns, pooled
from .shown_ratio import FORM
from .signals import ANGLES, bridged
from .survey import limit_of

ROWS = 5000  # of a recording that are looked at: the first ones
LEFT = FORM**2  # share of the squares of a command that a law may leave


class Told(NamedTuple):
    """A factor, and the variance of its logarithm."""

    factor: float
    variance: float


def factors_by_law(one: Recording, servo: Servo) -> dict[str, Told]:
    """Return the factors of the references that a controller reads; none where it is not told."""
    angle = 'load_position' if _reads_load(servo) else 'motor_position'
    if not servo.controller.parameters or not all(map(one.has, ('voltage', angle))):
        return {}
    rows = slice(0, min(ROWS, len(one)))
    told = one['voltage'][rows] - np.nan_to_num(one['added_command'][rows])
    kept = np.isfinite(told) & (np.abs(one['voltage'][rows]) < 0.98 * limit_of(servo))
    still = np.zeros(len(told))
    read = {name: bridged(one[name][rows]) if one.has(name) else still
            for name in (*REFERENCES, *ANGLES)}
    answers = {name: _answer(servo, {name: read[name]}, one.period) for name in REFERENCES}
    answers = {name: answer for name, answer in answers.items() if np.any(answer[kept])}
    angles = _answer(servo, {name: read[name] for name in ANGLES}, one.period)
    if not answers or not np.any(angles[kept]):
        return {}
    columns = np.stack([*answers.values(), angles, np.ones(len(told))], 1)[kept]
    seen = told[kept]
    fit = pooled([Columns(seen, columns, columns[:, :0])])
    rest, gains = seen - columns @ fit.shared, fit.shared
    if not (np.isfinite(fit.covariance).all() and min(gains[:-1]) > 0.0
            and np.sum(rest**2) < LEFT * np.sum((seen - seen.mean())**2)):
        return {}
    found = {}
    for k, name in enumerate(answers):
        slope = np.zeros(len(gains))
        slope[[k, -2]] = -1.0 / gains[k], 1.0 / gains[-2]
        found[name] = Told(float(gains[-2] / gains[k]), float(slope @ fit.covariance @ slope))
    return found


def _reads_load(servo: Servo) -> bool:
    on_load = servo.values.get('controller.on_load', 0.0)
    return servo.controller.name == 'cascade' or (isinstance(on_load, float) and on_load > 0.5)


def _answer(servo: Servo, read: Mapping[str, np.ndarray], period: float) -> np.ndarray:
    """Return the command of a controller without limits to channels alone, (rows,)."""
    still = [0.0] * len(next(iter(read.values())))
    columns = [read[name].tolist() if name in read else still for name in (*REFERENCES, *ANGLES)]
    p, memory = control_values(servo), [0.0] * CONTROLLER_SIZE
    vars(p).update({name: inf for name in vars(p) if 'limit' in name})
    ratio, law = servo.values['mechanism.ratio'], servo.controller.law
    return np.array([law(p, memory, place, speed, 0.0, motor, load, ratio, period)
                     for place, speed, motor, load in zip(*columns, strict=True)])
