"""Friction that one direction of a shaft has more of than the other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import Hypothesis, Mechanism
from .shaft_friction import over_speed, speed_of, SPEEDS


def friction_by_direction(builder: Builder, site: str) -> Iterator[Hypothesis]:
    """Yield the hypotheses of friction at a shaft that differs by direction."""
    yield from filter(None, (_asymmetric(builder, site, level) for level in (False, True)))
    yield from filter(None, (_one_way(builder, site, way) for way in (1.0, -1.0)))


def _asymmetric(builder: Builder, site: str, level: bool) -> Hypothesis | None:
    """
    Friction whose level, and growth, differ by direction, about the same mean or another.

    No direction has less than none: it would drive, as a weight does.
    """
    mechanism = Mechanism('asymmetric_friction', 'friction', site, ('direction',), 'none')
    top = builder.scales.top(f'{site}_speed')
    known = builder.rubbing(site, lambda one: speed_of(one, site), np.array([0.0, top]))
    most, slope = float(known[0]), float(known[1]) / top if top > 0.0 else 0.0
    if not level and not known.any():
        return None
    ways = (1.0, -1.0)[:1 + level]  # with a level of its own each direction has what it has
    form = over_speed(site, lambda x: np.column_stack(
        (*(way * np.ones(len(x)) / len(ways) for way in ways), x)))

    def torque(one: EquationErrors) -> np.ndarray:
        shape = form.shape(form.of(one))
        if level:
            shape[:, :2] = np.column_stack([way * (one.motion.direction == way) for way in ways])
        return -shape

    return builder.hypothesis(
        mechanism, builder.place(f'{site}_torque', torque), [0] * (1 + len(ways)), form=form,
        room=(-np.array([*[most] * len(ways), slope]),
              np.array([*[np.inf if level else most] * len(ways), slope])))


def _one_way(builder: Builder, site: str, way: float) -> Hypothesis | None:
    """Friction that one direction has and the other has not: constant, or growing with speed."""
    top = builder.scales.top(f'{site}_speed')
    knots = (0.0, top, top, *(share * top for share in SPEEDS))
    mechanism = Mechanism('asymmetric_friction', 'friction', site, ('direction',), 'none')
    form = over_speed(site, lambda x: np.column_stack((np.ones(len(x)), x, x**2 / top, *(
        np.minimum(x, knot) for knot in knots[3:]))))

    def torque(one: EquationErrors) -> np.ndarray:
        there = one.motion.direction == way
        return -way * there[:, None] * form.shape(form.of(one))

    return builder.hypothesis(mechanism, builder.place(f'{site}_torque', torque),
                              [1] * len(knots), knots, form=form, detail={'way': way})
