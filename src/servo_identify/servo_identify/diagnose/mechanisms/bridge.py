"""Volts that a bridge and its supply lose by the current that flows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .driven_columns import through
from .hypothesis import Form, Hypothesis, Mechanism
from .memory import lagged
from .shape_search import beside, best_shape, SHAPES

KNEES = (0.003, 0.01, 0.03, 0.1, 0.25, 0.5)  # shares of the largest current: its sign shows
WASTED = 0.2  # share of the largest command that a bridge may lose: more is no bridge that works
SETTLES = 10.0  # sample periods from which a supply gives way slowly


def dead_time(builder: Builder) -> Hypothesis | None:
    """
    Volts that a bridge loses by the sign of its current while neither switch is on.

    By the current that the recorded command would drive without that loss: what the motion asks
    for is blurred where the current jumps, and has no part of what else is missing.
    """
    values = builder.samples.servo.numbers
    resistance = values.get('drive.resistance')
    if not resistance:
        return None
    driven = {id(one): one.drive_current(one.servo.theta, one.measured.column('voltage', 0.0))
              for one in builder.samples.errors}
    top = max(float(np.nanmax(np.abs(current))) for current in driven.values())
    knees = tuple(share * top for share in KNEES)
    mechanism = Mechanism('drive_dead_band', 'drive', 'current', ('current',), 'odd')

    def lost(current: np.ndarray) -> np.ndarray:
        return -np.column_stack([np.clip(current / knee, -1.0, 1.0) for knee in knees])

    columns = through(builder, lambda one: lost(np.nan_to_num(driven[id(one)])))
    form = Form('current', 'A', 'V', lambda one: one.inner(driven[id(one)]), lost)
    settling = values.get('drive.inductance', 0.0) / resistance
    return builder.hypothesis(
        mechanism, columns, [1] * len(knees), knees, form=form,
        room=(0.0, WASTED * builder.scales.command), detail={
            'law': 'drive_dead_time', 'resistance': resistance, 'settling': settling})


def sag(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis | None]:
    """Volts that a supply loses by its resistance, at once or also slowly, as a battery does."""
    values = builder.samples.servo.numbers
    parts = {name: values.get(f'drive.{name}', 0.0) for name in ('resistance', 'back_emf')}
    if not all(parts.values()) or values.get('drive.proportional'):
        return
    mechanism = Mechanism('supply_sag', 'drive', 'command', ('command', 'current'), 'odd')

    def lost(one: EquationErrors, settling: float = 0.0) -> np.ndarray:
        drawn = one.regressor_command * np.nan_to_num(one.full(one.known_current))
        flows = [drawn] + ([lagged(drawn, settling, one.measured.period)] if settling else [])
        return -one.regressor_command[:, None] * np.column_stack(flows)

    at_once = through(builder, lost)
    yield builder.hypothesis(mechanism, at_once, [1], detail=parts)
    times = (SETTLES * builder.scales.period, builder.scales.duration)
    if times[0] < times[1]:
        settling = best_shape(*times, beside(builder.apart(at_once.table[:, 0]), lambda time: (
            builder.apart(through(builder, lambda one: lost(one, time)[:, 1:]).table[:, 0]))),
            builder.apart(residual))
        slow = replace(mechanism, memory=True)
        yield builder.hypothesis(slow, through(builder, lambda one: lost(one, settling)),
                                 [1, 1], (settling, *parts.values()), tried=SHAPES)
