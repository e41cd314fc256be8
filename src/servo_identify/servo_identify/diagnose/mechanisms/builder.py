"""Turns series along the measured motion into hypotheses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from servo_twin.physics.servo import Servo

from ..decisions import OPEN
from ..residuals.equation_errors import EquationErrors
from ..residuals.nuisance import Nuisance
from ..residuals.samples import ResidualSamples
from .hypothesis import ANY, Columns, Form, Hypothesis, Mechanism, Room, Series
from .shape_search import best_shape
from .signal_scales import Scales

VANISHING, NOTHING = 1e-6, 1e-12  # share of the largest column, and noise units: moves nothing


def placed(samples: ResidualSamples, signal: str, of: Series) -> np.ndarray:
    """Return what a signal does to residuals, (samples, n)."""
    series = [np.asarray(of(one)) for one in samples.errors]
    return samples.place({number: one.of_signal(signal, series[number])
                          for number, one in enumerate(samples.errors)}, series[0].shape[1])


@dataclass
class Builder:
    """
    Makes columns of signals for one set of residuals.

    ``explained``: the residuals are what an explanation leaves. ``nuisance`` is what may move
    without a fault.
    """

    samples: ResidualSamples
    explained: bool = False
    nuisance: Nuisance | None = None
    scales: Scales = field(init=False)

    def __post_init__(self) -> None:
        self.scales = Scales(self.samples)

    def place(self, signal: str, of: Series, factor: float = 1.0) -> Columns:
        """Return what a signal, times a factor, does to all residuals."""
        table = placed(self.samples, signal, of)
        return Columns(table if factor == 1.0 else factor * table, signal, of, factor)

    def turned(self, other: Servo, factor: float, beside: bool = False) -> Columns:
        """Return what another elastic servo does by the shaft that is not measured."""
        signal, _ = self.samples.errors[0].turned(other)
        return self.place(signal, lambda one: one.turned(other, beside)[1][:, None], factor)

    def apart(self, x: np.ndarray) -> np.ndarray:
        """Return what no value within tolerance, zero or instant does of (samples, ...)."""
        if self.nuisance is None:
            return x
        table = self.nuisance.columns
        return x - table @ (self._inverse @ (table.T @ x))

    def best_shape(self, low: float, high: float, column: Callable[[float], np.ndarray],
                   residual: np.ndarray) -> float:
        """Return what :func:`.shape_search.best_shape` does, beside what may move."""
        return best_shape(low, high, lambda number: self.apart(column(number)),
                          self.apart(residual))

    def best_columns(self, low: float, high: float, signal: str, of: Series,
                     residual: np.ndarray) -> tuple[float, Columns]:
        """Return the number of :meth:`best_shape`, and its columns; ``of(errors, number)``."""
        def columns(number: float) -> Columns:
            return self.place(signal, lambda one: of(one, number))

        best = self.best_shape(low, high, lambda number: columns(number).table[:, 0], residual)
        return best, columns(best)

    @cached_property
    def _inverse(self) -> np.ndarray:
        """Inverse of the products of what may move; 0 of what only repeats others."""
        assert self.nuisance is not None
        products = self.nuisance.columns.T @ self.nuisance.columns
        size = np.sqrt(np.diag(products))
        scale = np.outer(size, size)
        return np.linalg.pinv(products / scale, rcond=1e-9, hermitian=True) / scale

    def of_form(self, signal: str, form: Form) -> Columns:
        """Return what a curve over one variable, added to a signal, does to all residuals."""
        return self.place(signal, lambda one: form.shape(form.of(one)))

    def resisting(self, site: str, budget: Series) -> Columns:
        """Return what friction at a shaft of the size ``budget`` (N m) does."""
        return self.place(f'{site}_torque', lambda one: (
            -one.motion.direction[:, None] * budget(one)))

    def resistance(self, mechanism: Mechanism, form: Form, signs: Sequence[int],
                   knots: Sequence[Any] | np.ndarray = (), **more: Any) -> Hypothesis | None:
        """Return the hypothesis of friction whose size is a curve over one variable."""
        columns = self.resisting(mechanism.site, lambda one: form.shape(form.of(one)))
        return self.hypothesis(mechanism, columns, signs, knots, form=form, **more)

    def hypothesis(self, mechanism: Mechanism, columns: Columns, signs: Sequence[int],
                   knots: Sequence[Any] | np.ndarray = (), form: Form | None = None,
                   room: Room = ANY, **more: Any) -> Hypothesis | None:
        """Return a hypothesis without the columns that move nothing; None when none is left."""
        columns = columns.packed()
        size = np.sqrt((columns.table**2).sum(axis=0) / max(1, columns.samples))
        kept = np.flatnonzero(size > max(NOTHING, VANISHING * size.max(initial=0.0)))
        if not len(kept):
            return None
        if len(knots) == columns.size:
            knots = tuple(knots[int(k)] for k in kept)
        low, high = (edge[kept] if isinstance(edge, np.ndarray) else edge for edge in room)
        return Hypothesis(mechanism, columns.only(kept), np.asarray(signs)[kept],
                          knots=tuple(knots), form=form and form.only(kept), room=(low, high),
                          **more)

    def rubbing(self, site: str, of: Series, edges: np.ndarray) -> np.ndarray:
        """
        Return the friction of the file about each edge of a variable, N m at the shaft.

        It is what may be too much there: friction that is less than none would drive. In the
        balance of both shafts the two are one.
        """
        most, ratio = np.zeros(len(edges)), self.samples.servo.numbers['mechanism.ratio']
        for one in self.samples.errors:
            motor, load = (np.abs(one.of_file[f'{shaft}_resistance'])
                           for shaft in ('motor', 'load'))
            own = motor if site == 'motor' else load
            if 'torque' in self.samples.present:
                own = motor + load / ratio if site == 'motor' else load + motor * ratio
            near = np.abs(of(one)[:, None] - edges).argmin(axis=1)
            np.maximum.at(most, near, own)
        return most

    def rippling(self, one: EquationErrors) -> np.ndarray:
        """
        Return the current by which torque ripples, A at the inner samples.

        That of the load that was found too, once it is explained: before, ripple of this current
        would explain that load.
        """
        return one.predicted_current if self.explained else one.driving_current

    @property
    def by_motor(self) -> bool:
        """Whether the motor's angle is measured: of one encoder, whether it is the motor's."""
        return all('motor_position' in one.measured.channels for one in self.samples.errors)

    def turns(self, angle: str) -> bool:
        """Whether a shaft turns; ``angle`` is one of it. What moves straight has no orders."""
        return angle == 'motor_angle' or not self.samples.servo.linear

    def known(self, port: str) -> bool:
        """Whether the servo has an effect at a port."""
        return any(placed.effect.port == port for placed in self.samples.servo.effects)


def sides_of(builder: Builder) -> tuple[str, ...]:
    """
    Return the shafts whose friction can be told apart, the load's first.

    Both where the torque between them is measured. Without that sensor the torsion measures it:
    friction of the load twists the transmission and friction of the motor does not. That tells
    them apart where friction of the load as large as the gap of the torque balance would show in
    the transmission for certain.
    """
    samples = builder.samples
    if 'torque' not in samples.present:
        return tuple(site for site in ('load', 'motor') if site in samples.present)
    if 'transmission' in samples.present and samples.servo.mechanism.compliant:
        column = builder.resisting('load', lambda one: np.ones((len(one.motion.rows), 1))).table
        twisted, balanced = (float(np.mean(column[samples.rows(name)] ** 2))
                             for name in ('transmission', 'torque'))
        gap = float(np.mean(samples.base[samples.rows('torque')] ** 2))
        if twisted * gap >= OPEN**2 * balanced:
            return ('load', 'motor')
    return ('load',)
