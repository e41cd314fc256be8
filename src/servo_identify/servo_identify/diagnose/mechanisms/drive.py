"""The way from the command to the current: dead band, saturation, lag, delay."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import shifted
from ..residuals.nuisance import FAR
from .bridge import dead_time, sag
from .builder import Builder
from .driven_columns import of_current, through
from .hypothesis import Columns, Form, Hypothesis, Mechanism
from .memory import lagged, within_rate
from .shape_search import best_shapes, EACH, SHAPES

BANDS = (0.005, 0.01, 0.02, 0.04, 0.07, 0.11, 0.16, 0.23, 0.32, 0.45)
"""Shares of the largest command within which nothing may come."""

ABOUT = (0.7, 0.85, 1.0, 1.15, 1.3)  # of the command at which a drive comes, that it may open at
CEILINGS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.58, 0.66, 0.74, 0.82, 0.9, 0.96)
"""Shares of the largest command from which less may come."""

LAGS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # sample periods
SHARES = (0.0, 1.0)  # of a command that is lost or late: more than all would turn it round
DELAYS = (0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 18.0, 27.0)
BEGINS, ENDS = (0.02, 1.0), (0.05, 10.0)
"""Shares of the top speed at which the top command begins to be cut, and over which it is."""
GAINS = np.array((1.0 / FAR - 1.0, -1.0)), np.array((FAR - 1.0, 1.0))
"""By what shares the gain of a drive may be off, and by what by the sign of the command."""
Command = Callable[[EquationErrors], np.ndarray]
SLOWEST = 0.01  # limit of the rate of a command, share of the fastest change that was asked for


def drive_of(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """
    Yield the hypotheses of the drive; none where no command is recorded.

    ``residual`` (samples,) tells the limit of a rate, and where a drive comes with its command.
    """
    if not all('voltage' in one.measured.channels for one in builder.samples.errors):
        return
    top = builder.scales.command
    if not top > 0.0:
        return

    def shaped(name: str, change: Callable[[np.ndarray], np.ndarray], signs: list[int],
               knots: tuple[float, ...] = (), site: str = 'command',
               command: Command = asked, **more: Any) -> Hypothesis | None:
        mechanism = Mechanism(name, 'drive', site, ('command',), 'odd')
        form = Form('command', 'V', 'V', lambda one: one.inner(command(one)), change)
        return builder.hypothesis(
            mechanism, through(builder, lambda one: change(command(one))),
            signs, knots, form=form, **more)

    def band(command: np.ndarray) -> np.ndarray:
        return -np.column_stack([np.clip(command, -s * top, s * top) for s in BANDS])

    def gate(command: np.ndarray, *widths: float) -> np.ndarray:
        return -np.column_stack([np.where(np.abs(command) < width, command, 0.0)
                                 for width in widths])

    def rounded(command: np.ndarray) -> np.ndarray:
        return -np.column_stack([command / (1.0 + (command / (s * top)) ** 2) for s in BANDS])

    def both(command: np.ndarray) -> np.ndarray:
        return np.column_stack((command, np.abs(command)))

    def ceiling(command: np.ndarray) -> np.ndarray:
        return _beyond(command, tuple(s * top for s in CEILINGS))

    opens = builder.best_shape(BANDS[0] * top, BANDS[-1] * top, lambda width: through(
        builder, lambda one: gate(one.regressor_command, width)).table[:, 0], residual)
    gates = tuple(share * opens for share in ABOUT)
    # within a dead band the motion does not show how a command trembles
    by = (asked,) if all('current' in one.measured.channels for one in builder.samples.errors
                         ) else (asked, recorded)
    yield from filter(None, (
        *(shaped('drive_dead_band', band, [1] * len(BANDS), tuple(s * top for s in BANDS),
                 command=one, room=SHARES) for one in by),
        # a drive that comes with all of the command once it comes
        shaped('drive_dead_band', lambda command: gate(command, *gates), [1] * len(ABOUT),
               gates, tried=SHAPES, detail={'opens': True}, room=SHARES),
        # one whose answer to small commands fades in, as that of a push-pull stage
        shaped('drive_dead_band', rounded, [1] * len(BANDS), tuple(s * top for s in BANDS),
               room=SHARES),
        dead_time(builder), *sag(builder, residual),
        shaped('drive_saturation', ceiling, [1] * len(CEILINGS),
               tuple(s * top for s in CEILINGS)),
        _limited(builder), _rate_limited(builder, residual), _out_of_voltage(builder, residual),
        # a gain that differs by the sign of the command
        'drive.gain' in builder.samples.servo.numbers and shaped(
            'parameter:gain', both, [0, 0], site='drive', detail={'law': 'drive_asymmetry'},
            room=GAINS)))
    period = builder.scales.period
    for name, shares, late in (('current_lag', LAGS, lagged),
                               ('current_lag', LAGS, _lagged_twice),
                               ('command_delay', DELAYS, shifted)):
        site = 'current' if name == 'current_lag' else 'command'
        mechanism = Mechanism(name, 'drive', site, ('time',), 'none', memory=True)
        times = tuple(share * period for share in shares)
        one = builder.hypothesis(mechanism, through(builder, partial(_change, late, times)),
                                 [1] * len(times), times, room=SHARES)
        if one:
            yield one


def _limited(builder: Builder) -> Hypothesis | None:
    """A winding that gets no more current than a limit, whatever the command would drive."""
    if 'drive.resistance' not in builder.samples.servo.numbers:
        return None  # a command of a current is limited as a command

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


def _rate_limited(builder: Builder, residual: np.ndarray) -> Hypothesis | None:
    """A command that is followed no faster than a limit, up and down."""
    top = max(float(np.max(np.abs(np.diff(one.regressor_command)), initial=0.0))
              / one.measured.period for one in builder.samples.errors)
    if not top > 0.0:
        return None

    def lost(one: EquationErrors, rate: float) -> np.ndarray:
        command = one.regressor_command
        return (within_rate(command, rate * one.measured.period) - command)[:, None]

    rate = builder.best_shape(SLOWEST * top, top, lambda rate: through(
        builder, lambda one: lost(one, rate)).table[:, 0], residual)
    mechanism = Mechanism('command_rate_limit', 'drive', 'command', ('command',), 'odd',
                          memory=True)
    return builder.hypothesis(mechanism, through(builder, lambda one: lost(one, rate)), [1],
                              (rate,), tried=SHAPES)


def _out_of_voltage(builder: Builder, residual: np.ndarray) -> Hypothesis | None:
    """
    A command of current that a supply cannot drive at speed; braking finds more.

    Where the twin has a winding, that is a limit of its voltage.
    """
    if 'drive.resistance' in builder.samples.servo.numbers:
        return None
    top = builder.scales.command
    fastest = max(float(np.max(np.sign(one.regressor_command) * one.fast_speed, initial=0.0))
                  for one in builder.samples.errors)
    if not fastest > 0.0:
        return None

    def line(begins: float, over: float) -> tuple[float, float]:
        return top * (1.0 + begins / over), top / over

    def lost(one: EquationErrors, limit: float, slope: float) -> np.ndarray:
        way = np.sign(one.regressor_command)
        most = np.maximum(limit - slope * way * one.fast_speed, 0.0)
        return -way[:, None] * np.maximum(np.abs(one.regressor_command) - most, 0.0)[:, None]

    limit, slope = line(*best_shapes(
        [(fastest * low, fastest * high) for low, high in (BEGINS, ENDS)],
        lambda *ends: builder.apart(through(
            builder, lambda one: lost(one, *line(*ends))).table[:, 0]),
        builder.apart(residual)))
    mechanism = Mechanism('torque_speed_limit', 'drive', 'command', ('command', 'speed'), 'odd')
    return builder.hypothesis(mechanism, through(builder, lambda one: lost(one, limit, slope)),
                              [1], (limit,), tried=EACH**2, detail={'slope': slope})


def delay_of_command(builder: Builder, times: tuple[float, ...]) -> Columns:
    """Return what a command that is late by some times (s) does to all residuals."""
    return through(builder, partial(_change, shifted, times))


def _change(late: Callable[[np.ndarray, float, float], np.ndarray], times: tuple[float, ...],
            one: EquationErrors) -> np.ndarray:
    """Return what lags or delays of some times (s) change of a command, (samples, times)."""
    command, period = one.regressor_command, one.measured.period
    return np.column_stack([late(command, time, period) - command for time in times])


def asked(one: EquationErrors) -> np.ndarray:
    """Return the command by which a drive is evaluated, V at every sample."""
    return one.regressor_command


def recorded(one: EquationErrors) -> np.ndarray:
    """Return the command as it was recorded, V at every sample."""
    return one.measured.column('voltage', 0.0)


def _beyond(x: np.ndarray, knots: tuple[float, ...]) -> np.ndarray:
    """Return what lies beyond each of some sizes, as it is lost, (samples, knots)."""
    return -np.sign(x)[:, None] * np.column_stack(
        [np.maximum(np.abs(x) - knot, 0.0) for knot in knots])


def _lagged_twice(command: np.ndarray, settling: float, period: float) -> np.ndarray:
    """The same of second order, as a current loop of its own is: as late in all."""
    return lagged(lagged(command, 0.5 * settling, period), 0.5 * settling, period)
