"""A servo whose inertia another axis changes, while that axis stands still."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

from .ports import Carried
from .servo import Servo


def with_fixed_inertia(servo: Servo, coupled_angle: float) -> Servo:
    """
    Return the servo with what it carries at one angle (rad) of the other axis.

    The inertia goes to ``mechanism.load_inertia``, its tolerance by the same share; the effects
    that gave it are gone.
    """
    carried = [p for p in servo.effects
               if p.effect.port == 'inertia' and 'coupled_angle' in p.effect.variables()]
    if not carried:
        return servo
    path, added = 'mechanism.load_inertia', 0.0
    for placed in carried:
        values = SimpleNamespace(**{name: servo.values[f'effects.{placed.name}.{name}']
                                    for name in placed.effect.parameters})
        added += placed.effect.law(values, (), Carried(0.0, coupled_angle, 0.0), 0.0)
    own = servo.values[path]
    assert isinstance(own, float)  # an inertia is no row
    share = 1.0 + added / own
    bare = servo.without_effects(lambda placed: placed in carried)
    tolerance = dict(bare.tolerance)
    if path in tolerance:
        low, high = tolerance[path]
        tolerance[path] = (low * share, high * share)
    return replace(bare.with_values({path: own * share}), tolerance=tolerance)
