"""One rigid link that weighs and turns as a joint's load does."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, sqrt

from ..joint import GRAVITY, Joint, ModelError

_LEVER = 0.1  # m, at which a link carries its mass where nothing says how much it is


@dataclass(frozen=True)
class Link:
    """
    A link on an axis through the origin: ``mass`` in kg, its centre ``place`` in m.

    ``inertia`` is that about the centre, the same about every axis, kg m2; ``axis`` that of the
    joint. Gravity points along -z.
    """

    mass: float
    place: tuple[float, float, float]
    inertia: float
    axis: tuple[float, float, float]


def link_of(joint: Joint, with_armature: bool = False) -> Link:
    """
    Return a link whose inertia about the axis and gravity torque are those of a joint.

    Its mass is free: a servo file says nothing of it. ``with_armature`` gives it the armature
    too, for formats that have none. Raises ModelError for what no link can be.
    """
    whole = joint.inertia + (joint.armature if with_armature else 0.0)
    inertia = whole or 1e-9 * joint.armature
    if joint.slides:
        share = joint.cosine / (inertia * GRAVITY)
        if abs(share) > 1.0:
            raise ModelError(f'joint {joint.name!r}: a force of {joint.cosine:g} N is more than '
                             f'the weight of {inertia:g} kg')
        return Link(inertia, (0.0, 0.0, 0.0), 0.01 * inertia,
                    (sqrt(1.0 - share * share), 0.0, -share))
    weight = hypot(joint.cosine, joint.sine) / GRAVITY  # mass times lever, kg m
    if weight and not whole:
        raise ModelError(f'joint {joint.name!r}: gravity pulls with {weight * GRAVITY:g} N m at '
                         f'a load without inertia')
    mass = max(2.0 * weight**2 / inertia, weight / _LEVER) or inertia / _LEVER**2
    place = (-joint.cosine / (mass * GRAVITY), 0.0, joint.sine / (mass * GRAVITY))
    return Link(mass, place, inertia - weight**2 / mass, (0.0, -1.0, 0.0))
