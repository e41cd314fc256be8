"""The servo with the causes of an explanation in it, as `augmented.yaml` and a report have it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from servo_twin.physics.servo import Placed, Provenance, Servo

from .candidates import Candidate
from .explanation import Explanation
from .spring import SPRING, spring_values, sprung
from .stack import Stack

SOURCE = 'gap diagnosis'
SURE = 3.0  # standard deviations within which a value that was found is taken to lie


def augmented(servo: Servo, stack: Stack, explanation: Explanation,
              recordings: tuple[str, ...]) -> Servo:
    """Return the user's servo with the causes of an explanation in it, with their spread."""
    extended = stack.extended
    slots = extended.servo.slots()
    theta = explanation.theta
    placed, values, provenance = [], {}, dict(servo.provenance)
    names = {p.name for p in servo.effects}

    def value_of(path):
        part = tuple(float(v) for v in theta[slots[path]])
        return part if isinstance(extended.servo.values[path], tuple) else part[0]

    for path in servo.tolerance:
        if path in slots and value_of(path) != servo.values[path]:
            values[path] = value_of(path)
            provenance[path] = Provenance(f'{SOURCE}, within its tolerance',
                                          explanation.spread(path), recordings)
    for cause in explanation.causes:
        for path in cause.paths:
            if path in servo.values:
                values[path] = value_of(path)
                provenance[path] = Provenance(f'{SOURCE}, beyond its tolerance',
                                              explanation.spread(path), recordings)
        if cause.switch is None:
            continue
        instance = cause.name if cause.name not in names else f'{cause.name}_{cause.site}'
        names.add(instance)
        placed.append(Placed(instance, cause.effect, cause.site))
        prefix = f'effects.{extended.servo.effects[cause.switch].name}'
        for name in cause.effect.parameters:
            path = f'effects.{instance}.{name}'
            values[path] = value_of(f'{prefix}.{name}')
            std = explanation.spread(f'{prefix}.{name}')
            provenance[path] = Provenance(SOURCE, None if np.isnan(std) else std, recordings)
    freed = {path for c in explanation.causes for path in c.paths}
    tolerance = {p: t for p, t in servo.tolerance.items() if p not in freed}
    better = replace(servo, effects=servo.effects + tuple(placed),
                     values={**servo.values, **values}, provenance=provenance)
    if any(is_spring(cause) for cause in explanation.causes):
        better = sprung(better, theta)
        provenance |= {path: Provenance(SOURCE, one['std'], recordings)
                       for path, one in spring_of(servo, explanation).items()}
    return replace(better, provenance=provenance, tolerance=_known(better, provenance, tolerance))


def is_spring(cause: Candidate) -> bool:
    """Tell whether a cause is the spring that a rigid twin lacks."""
    return bool(set(cause.paths) & set(SPRING))


def spring_of(servo: Servo, explanation: Explanation) -> dict[str, dict]:
    """Return stiffness and damping of an explanation with a spring, as a report has them."""
    return spring_values(servo, explanation.theta,
                         [float(np.nan_to_num(explanation.spread(path))) for path in SPRING])


def _known(servo: Servo, provenance, tolerance) -> dict[str, tuple[float, float]]:
    """Return the tolerances with those of what was found here: as far as it is known."""
    known = dict(tolerance)
    for path, declared in servo.declarations():
        said = provenance.get(path)
        sized = declared.off is not None or path.startswith(('mechanism.', 'drive.'))
        found = said is not None and said.source.startswith(SOURCE) and said.std
        if found and sized and not declared.row and path not in known:
            low, high = declared.bounds
            value, reach = servo.values[path], SURE * said.std
            known[path] = (max(low, value - reach), min(high, value + reach))
    return known
