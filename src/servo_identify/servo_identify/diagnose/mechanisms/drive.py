"""The way from the command to the current: dead band, gain, lag, delay, and its limits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import shifted
from ..residuals.nuisance import FAR
from .bridge import dead_time, sag
from .builder import Builder
from .drive_limits import asked, Command, limits_of, over_command, recorded, SHARES
from .driven_columns import through
from .hypothesis import Columns, Hypothesis, Mechanism
from .memory import lagged
from .shape_search import SHAPES

BANDS = (0.005, 0.01, 0.02, 0.04, 0.07, 0.11, 0.16, 0.23, 0.32, 0.45)
"""Shares of the largest command within which nothing may come."""

ABOUT = (0.7, 0.85, 1.0, 1.15, 1.3)  # of the command at which a drive comes, that it may open at
LAGS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # sample periods
DELAYS = (0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 18.0, 27.0)
GAINS = np.array((1.0 / FAR - 1.0, -1.0)), np.array((FAR - 1.0, 1.0))
"""By what shares the gain of a drive may be off, and by what by the sign of the command."""


def drive_of(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """
    Yield the hypotheses of the drive; none where no command is recorded.

    ``residual`` (samples,) tells the limit of a rate, and where a drive comes with its command.
    A command is counted as the motion asks for it: that which was recorded follows what is
    missing, and a curve over it would explain anything. Where no current shows what came, a dead
    band and a limit are sought in the recorded one too: the motion does not show what was asked
    for there.
    """
    if not all('voltage' in one.measured.channels for one in builder.samples.errors):
        return
    if not builder.scales.command > 0.0:
        return
    measured = all('current' in one.measured.channels for one in builder.samples.errors)
    yield from _curves(builder, residual, (asked,) if measured else (asked, recorded))
    yield from limits_of(builder, residual, not measured)
    yield from filter(None, (dead_time(builder), *sag(builder, residual)))
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


def delay_of_command(builder: Builder, times: tuple[float, ...]) -> Columns:
    """Return what a command that is late by some times (s) does to all residuals."""
    return through(builder, partial(_change, shifted, times))


def _change(late: Callable[[np.ndarray, float, float], np.ndarray], times: tuple[float, ...],
            one: EquationErrors) -> np.ndarray:
    """Return what lags or delays of some times (s) change of a command, (samples, times)."""
    command, period = one.regressor_command, one.measured.period
    return np.column_stack([late(command, time, period) - command for time in times])


def _lagged_twice(command: np.ndarray, settling: float, period: float) -> np.ndarray:
    """The same of second order, as a current loop of its own is: as late in all."""
    return lagged(lagged(command, 0.5 * settling, period), 0.5 * settling, period)


def _curves(builder: Builder, residual: np.ndarray, commands: Sequence[Command]
            ) -> Iterator[Hypothesis]:
    """Yield what a drive may make of a command as a curve; ``commands`` of a dead band."""
    top = builder.scales.command

    shaped = partial(over_command, builder)

    def band(command: np.ndarray) -> np.ndarray:
        return -np.column_stack([np.clip(command, -s * top, s * top) for s in BANDS])

    def uneven(command: np.ndarray) -> np.ndarray:
        return -np.column_stack([np.clip(command, low * top, high * top) for s in BANDS
                                 for low, high in ((-s, 0.0), (0.0, s))])

    def gate(command: np.ndarray, *widths: float) -> np.ndarray:
        return -np.column_stack([np.where(np.abs(command) < width, command, 0.0)
                                 for width in widths])

    def rounded(command: np.ndarray) -> np.ndarray:
        return -np.column_stack([command / (1.0 + (command / (s * top)) ** 2) for s in BANDS])

    def both(command: np.ndarray) -> np.ndarray:
        return np.column_stack((command, np.abs(command)))

    opens = builder.best_shape(BANDS[0] * top, BANDS[-1] * top, lambda width: through(
        builder, lambda one: gate(asked(one), width)).table[:, 0], residual)
    gates = tuple(share * opens for share in ABOUT)
    widths = tuple(share * top for share in BANDS)
    yield from filter(None, (
        *(shaped('drive_dead_band', band, [1] * len(BANDS), widths, command=one, room=SHARES)
          for one in commands),
        # one that is wider one way, as the overlap of a valve
        shaped('drive_dead_band', uneven, [1] * 2 * len(BANDS),
               tuple(np.repeat(widths, 2)), room=SHARES, detail={'law': 'uneven_dead_band'}),
        # a drive that comes with all of the command once it comes
        shaped('drive_dead_band', lambda command: gate(command, *gates), [1] * len(ABOUT),
               gates, tried=SHAPES, detail={'opens': True}, room=SHARES),
        # one whose answer to small commands fades in, as that of a push-pull stage
        shaped('drive_dead_band', rounded, [1] * len(BANDS), widths, room=SHARES),
        # a gain that differs by the sign of the command
        shaped('parameter:gain', both, [0, 0], site='drive', room=GAINS,
               detail={'law': 'drive_asymmetry'})
        if 'drive.gain' in builder.samples.servo.numbers else None))
