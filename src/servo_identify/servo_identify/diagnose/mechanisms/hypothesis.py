"""One mechanism at one place, as columns of the regression: the hypothesis that it is missing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

UNKNOWN = 'unknown'
"""Name of a pattern that no mechanism of the table has."""

EXTERNAL = 'external_torque'
"""Name of a torque from outside that repeats in time: no part of the machine."""

CLOCK = 'clock_drift'
"""Name of a channel whose time runs apart from that of the others: a matter of the recording."""

SLIP = 'slip'
"""Name of a transmission that slips: what it has lost depends on all that it has done."""

OUTSIDE = (EXTERNAL, CLOCK, SLIP)
"""Names of what no effect of a twin can show."""

BY_RECORDING = 'recording'
"""Variable of what is another in each recording: no value of a servo file."""

TURN = 2.0 * np.pi

Room = tuple[float | np.ndarray, float | np.ndarray]
"""Between what amplitudes lie, all alike or each."""

ANY: Room = (-np.inf, np.inf)

Series = Callable[..., np.ndarray]
"""``of(errors)``: a signal of one recording at the inner or all samples, (samples, n)."""


@dataclass(frozen=True)
class Mechanism:
    """
    What kind of thing acts, where, and on which variables.

    ``name`` is that of the table of signatures; ``port`` and ``site`` where it acts;
    ``variables`` what it depends on, the first being that of its curve; ``symmetry`` how it
    answers to the other direction (odd, even, none); ``memory`` whether it remembers;
    ``driving`` whether it is of the reading that drives the twin.
    """

    name: str
    port: str
    site: str
    variables: tuple[str, ...]
    symmetry: str
    memory: bool = False
    driving: bool = False

    @property
    def key(self) -> tuple[str, ...]:
        """Name and site (and variables of what has no name): what makes it the same cause."""
        if self.name != UNKNOWN:
            return self.name, self.site
        return (self.name, self.port, *self.variables, self.symmetry)

    @property
    def outside(self) -> bool:
        """Whether no twin of the plant under what was recorded can show it."""
        return (self.site == 'controller' or self.name in OUTSIDE or self.driving
                or BY_RECORDING in self.variables)

    @property
    def label(self) -> str:
        """For people."""
        return f'{self.name} ({self.site})' if self.site else self.name


@dataclass(frozen=True)
class Columns:
    """
    What a signal of the equations does to all residuals for one unit of each of its amplitudes.

    ``table`` (samples, n); ``signal`` names the signal and ``of`` returns it, times ``factor``;
    an empty ``signal`` stands for a value of the servo file. Packed columns have the samples that
    they move alone in their table: ``rows``, of ``samples``.
    """

    table: np.ndarray
    signal: str = ''
    of: Series | None = None
    factor: float = 1.0
    rows: np.ndarray | None = None
    samples: int = 0

    def only(self, kept: np.ndarray) -> Columns:
        """Return some of the columns; ``kept`` are their numbers."""
        of = self.of
        chosen = None if of is None else (lambda one: of(one)[:, kept])
        return replace(self, table=np.asfortranarray(self.table[:, kept]), of=chosen)

    def plus(self, other: Columns) -> Columns:
        """Return the columns with what another signal does as they move; it is their signal."""
        return replace(self, table=self.whole() + other.whole(), rows=None, samples=0)

    def packed(self) -> Columns:
        """Return the columns with the samples that they move: most move one equation of five."""
        if self.rows is not None:
            return self
        rows = np.flatnonzero(self.table.any(axis=1))
        return replace(self, table=np.asfortranarray(self.table[rows]), rows=rows,
                       samples=len(self.table))

    def at(self, samples: np.ndarray) -> np.ndarray:
        """Return the columns at some samples, by their numbers, (numbers, n)."""
        if self.rows is None:
            return self.table[samples]
        place = np.full(self.samples, -1)
        place[self.rows] = np.arange(len(self.rows))
        place = place[samples]
        moved = np.flatnonzero(place >= 0)
        some = np.zeros((len(samples), self.size))
        some[moved] = self.table[place[moved]]
        return some

    def whole(self) -> np.ndarray:
        """Return the columns at all samples, (samples, n)."""
        return self.table if self.rows is None else self.at(np.arange(self.samples))

    def summed(self) -> Columns:
        """Return the columns without their table, for once it is summed up."""
        return replace(self, table=np.empty((0, self.size)), rows=None)

    @property
    def size(self) -> int:
        """Number of columns."""
        return self.table.shape[1]


@dataclass(frozen=True)
class Form:
    """
    A mechanism as a curve over one variable, for one unit of each amplitude.

    ``of(errors)`` returns the variable at the inner samples of a recording, in ``unit``;
    ``shape(x)`` the curve, (len(x), n), in ``y_unit``: what friction resists with, the torque, the
    angle or command that is lost; over an angle, after a ``period`` it may repeat.
    """

    variable: str
    unit: str
    y_unit: str
    of: Series
    shape: Callable[[np.ndarray], np.ndarray]
    period: float = TURN

    def only(self, kept: np.ndarray) -> Form:
        """Return some of the columns; ``kept`` are their numbers."""
        shape = self.shape
        return replace(self, shape=lambda x: shape(x)[:, kept])


@dataclass(frozen=True)
class Hypothesis:
    """
    A mechanism with the columns of its flexible form.

    ``signs`` (n,): 0 for a free amplitude, 1 for one of a group that shares a sign. ``either``:
    that sign may be plus or minus; otherwise it is plus. ``knots`` say for which values of the
    variable the columns stand. ``path`` is the value of the servo file that would be off; ``room``
    is between what the amplitudes lie, all alike or each. ``tried`` counts the alternatives
    (orders, delays) that this one was chosen from; ``detail`` holds what else was searched; of
    what no value of the twin can be, ``told(knots, amplitudes, servo)``, its size. ``form`` is
    its curve, where it is one.
    """

    mechanism: Mechanism
    columns: Columns
    signs: np.ndarray
    either: bool = False
    knots: tuple[Any, ...] = ()
    path: str = ''
    room: Room = ANY
    tried: int = 1
    detail: Mapping[str, Any] = field(default_factory=dict)
    form: Form | None = None

    def bounds(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return (low, high) of the amplitudes: one pair, or one for each sign."""
        low, high = (np.full(self.columns.size, edge) for edge in self.room)
        shared = self.signs == 1
        plus = np.where(shared, 0.0, low), high
        minus = low, np.where(shared, 0.0, high)
        if not shared.any():
            return [(low, high)]
        return [plus, minus] if self.either else [plus]
