"""What a drive does not give beyond a limit: of the command, its rate, the speed, the power."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .driven_columns import of_current, through
from .hypothesis import Form, Hypothesis, Mechanism
from .memory import within_rate
from .shape_search import best_shapes, EACH, SHAPES

Command = Callable[[EquationErrors], np.ndarray]
CEILINGS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.58, 0.66, 0.74, 0.82, 0.9, 0.96)
"""Shares of the largest command from which less may come."""

BEGINS, ENDS = (0.02, 1.0), (0.05, 10.0)
"""Shares of the top speed at which the top command begins to be cut, and over which it is."""
LEAST = 0.02  # share of the largest power of braking asked for, down to which it may be cut
SLOWEST = 0.01  # limit of the rate of a command, share of the fastest change that was asked for
CAME = 0.99  # of all samples, whose largest command the motion shows
SHARES = (0.0, 1.0)  # of a command that is lost or late: more than all would turn it round


def asked(one: EquationErrors) -> np.ndarray:
    """Return the command by which a drive is evaluated, V at every sample."""
    return one.regressor_command


def recorded(one: EquationErrors) -> np.ndarray:
    """Return the command as it was recorded, V at every sample."""
    return one.measured.column('voltage', 0.0)


def over_command(builder: Builder, name: str, change: Callable[[np.ndarray], np.ndarray],
                 signs: Sequence[int], knots: tuple[float, ...] = (), command: Command = asked,
                 site: str = 'command', **more: Any) -> Hypothesis | None:
    """Return the hypothesis of what a drive adds to a command as a curve over it."""
    mechanism = Mechanism(name, 'drive', site, ('command',), 'odd')
    form = Form('command', 'V', 'V', lambda one: one.inner(command(one)), change)
    return builder.hypothesis(mechanism, through(builder, lambda one: change(command(one))),
                              signs, knots, form=form, **more)


def limits_of(builder: Builder, residual: np.ndarray, sought: bool) -> Iterator[Hypothesis]:
    """
    Yield the hypotheses of limits; ``residual`` (samples,) tells where they lie.

    ``sought``: in the command as it was recorded too. Of a command of current alone speed and
    power are limits; a winding has one of its voltage, and its current may have one.
    """
    winding = 'drive.resistance' in builder.samples.servo.numbers
    limits = (_rate_limited,) if winding else (_rate_limited, _out_of_voltage, _braking)
    yield from filter(None, (
        _saturation(builder), _limited(builder) if winding else None,
        _cut(builder, residual) if sought else None,
        *(limit(builder, residual, command) for limit in limits
          for command in (asked, recorded)[:1 + sought])))


def _saturation(builder: Builder) -> Hypothesis | None:
    """A command of which less comes, or nothing more, beyond a size."""
    knots = tuple(share * builder.scales.command for share in CEILINGS)
    return over_command(builder, 'drive_saturation', lambda command: _beyond(command, knots),
                        [1] * len(knots), knots)


def _cut(builder: Builder, residual: np.ndarray) -> Hypothesis | None:
    """A recorded command of which nothing more comes beyond one size: at least what came does."""
    top = builder.scales.command
    least = max(float(np.quantile(np.abs(asked(one)), CAME)) for one in builder.samples.errors)
    if least >= top:
        return None
    limit = builder.best_shape(
        max(least, CEILINGS[0] * top), top, lambda limit: through(
            builder, lambda one: _beyond(recorded(one), (limit,))).table[:, 0], residual)
    return over_command(builder, 'drive_saturation', lambda command: _beyond(command, (limit,)),
                        [1], (limit,), recorded, tried=SHAPES, room=SHARES)


def _limited(builder: Builder) -> Hypothesis | None:
    """A winding that gets no more current than a limit, whatever the command would drive."""
    top = max(float(np.nanmax(np.abs(one.driven_current))) for one in builder.samples.errors)
    knots = tuple(share * top for share in CEILINGS)

    def lost(current: np.ndarray) -> np.ndarray:
        return _beyond(current, knots)

    mechanism = Mechanism('drive_saturation', 'drive', 'current', ('current',), 'odd')
    columns = of_current(builder, lambda one: lost(one.driven_current))
    return builder.hypothesis(mechanism, columns, [1] * len(knots), knots,
                              form=Form('current', 'A', 'A',
                                        lambda one: one.inner(one.driven_current), lost),
                              detail={'law': 'current_limit'})


def _rate_limited(builder: Builder, residual: np.ndarray, command: Command
                  ) -> Hypothesis | None:
    """A command that is followed no faster than a limit, up and down."""
    top = max(float(np.max(np.abs(np.diff(command(one))), initial=0.0))
              / one.measured.period for one in builder.samples.errors)
    if not top > 0.0:
        return None

    def lost(one: EquationErrors, rate: float) -> np.ndarray:
        whole = command(one)
        return (within_rate(whole, rate * one.measured.period) - whole)[:, None]

    rate = builder.best_shape(SLOWEST * top, top, lambda rate: through(
        builder, lambda one: lost(one, rate)).table[:, 0], residual)
    mechanism = Mechanism('command_rate_limit', 'drive', 'command', ('command',), 'odd',
                          memory=True)
    return builder.hypothesis(mechanism, through(builder, lambda one: lost(one, rate)), [1],
                              (rate,), tried=SHAPES, room=SHARES)


def _out_of_voltage(builder: Builder, residual: np.ndarray, command: Command
                    ) -> Hypothesis | None:
    """A command of current that a supply cannot drive at speed; braking finds more."""
    top = builder.scales.command
    fastest = max(float(np.max(np.sign(command(one)) * one.fast_speed, initial=0.0))
                  for one in builder.samples.errors)
    if not fastest > 0.0:
        return None

    def line(begins: float, over: float) -> tuple[float, float]:
        return top * (1.0 + begins / over), top / over

    def lost(one: EquationErrors, limit: float, slope: float) -> np.ndarray:
        way = np.sign(command(one))
        most = np.maximum(limit - slope * way * one.fast_speed, 0.0)
        return -way[:, None] * np.maximum(np.abs(command(one)) - most, 0.0)[:, None]

    limit, slope = line(*best_shapes(
        [(fastest * low, fastest * high) for low, high in (BEGINS, ENDS)],
        lambda *ends: builder.apart(through(
            builder, lambda one: lost(one, *line(*ends))).table[:, 0]),
        builder.apart(residual)))
    mechanism = Mechanism('torque_speed_limit', 'drive', 'command', ('command', 'speed'), 'odd')
    return builder.hypothesis(mechanism, through(builder, lambda one: lost(one, limit, slope)),
                              [1], (limit,), tried=EACH**2, room=SHARES, detail={'slope': slope})


def _braking(builder: Builder, residual: np.ndarray, command: Command) -> Hypothesis | None:
    """A command of current that brakes with no more than so much power."""
    def power_of(one: EquationErrors) -> np.ndarray:
        return np.maximum(-command(one) * one.fast_speed, 0.0)

    most = max(float(np.max(power_of(one))) for one in builder.samples.errors)
    if not most > 0.0:
        return None

    def lost(one: EquationErrors, limit: float) -> np.ndarray:
        power = power_of(one)
        share = np.maximum(power - limit, 0.0) / np.maximum(power, limit)
        return -(share * command(one))[:, None]

    limit = builder.best_shape(LEAST * most, most, lambda limit: through(
        builder, lambda one: lost(one, limit)).table[:, 0], residual)
    mechanism = Mechanism('braking_power_limit', 'drive', 'command', ('command', 'speed'), 'odd')
    return builder.hypothesis(mechanism, through(builder, lambda one: lost(one, limit)), [1],
                              (limit,), tried=SHAPES, room=SHARES)


def _beyond(x: np.ndarray, knots: tuple[float, ...]) -> np.ndarray:
    """Return what lies beyond each of some sizes, as it is lost, (samples, knots)."""
    return -np.sign(x)[:, None] * np.column_stack(
        [np.maximum(np.abs(x) - knot, 0.0) for knot in knots])
