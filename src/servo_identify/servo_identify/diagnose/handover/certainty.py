"""How sure the values of missing effects are, and the file that says so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from servo_twin.physics.servo import Provenance, Servo

from ...fit.estimate import Estimate
from ...fit.free_values import SURE
from .added import Added

SOURCE = 'gap diagnosis'


def spread(several: Sequence[Added], joint: Estimate) -> dict[str, float]:
    """
    Return the standard deviations of a fit, at least half of what the equations say otherwise.

    A fit counts noise alone. Where the form is not quite right, equations and simulation weigh
    the misfit differently, and neither is surer than they agree.
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
        spread[name] = max(std, apart)
    return spread


def within_spread(several: Sequence[Added], joint: Estimate) -> dict[str, tuple[float, float]]:
    """Return between what the free values of effects lie, by path, each of a row by its number."""
    std, found = spread(several, joint), {}
    for path in (path for one in several for path in one.free):
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
        if path in servo.values and path not in servo.tolerance:
            known = said.get(path)
            worst = max((s for s in (known.std if known and known.source == SOURCE else None, std)
                         if s is not None and np.isfinite(s)), default=None)
            said[path] = Provenance(SOURCE, worst, bags)
    return replace(servo, provenance=said)
