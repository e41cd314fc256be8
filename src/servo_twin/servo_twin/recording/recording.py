"""What one recording of one machine holds: named columns in SI units, and what they are of."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .channels import COLUMNS as COLUMNS
from .channels import MAY_BE_EMPTY as MAY_BE_EMPTY

_AT_ONCE = 60_000  # samples of a column that are looked at together


RESAMPLED = 'resampled to'
"""Words of the note of a recording whose uneven times were brought onto an even grid."""


@dataclass(frozen=True)
class Recording:
    """
    One recording, sampled evenly.

    ``columns`` maps every name of :data:`COLUMNS` to an array of shape (samples,), float64; sample
    k was taken at ``start + k * period`` and has the running number ``sequence + k``. ``voltage``,
    ``added_command`` and the references are held from sample k to sample k + 1, all others are
    measured at sample k. Positions in rad, each on its own shaft; ``coupled_position`` is the load
    angle of another axis that this one carries, on which its inertia may depend.
    ``added_command`` is the part of ``voltage`` that was added to what the controller makes of
    its error, in the same unit; NaN adds nothing.
    Raises ValueError when a column has another length or the period is not positive.
    """

    name: str
    period: float
    columns: dict[str, np.ndarray]
    start: float = 0.0
    family: str = ''
    replicate: int = 0
    servo: str = ''
    servo_file: str = ''
    note: str = ''
    digest: str = ''
    warnings: tuple[str, ...] = field(default=())
    sequence: int = 0

    @property
    def resampled(self) -> bool:
        """Whether its times were uneven: there a held command may be off by part of a row."""
        return RESAMPLED in self.note

    def __post_init__(self) -> None:
        if not self.period > 0.0:
            raise ValueError(f'{self.name}: period = {self.period} s, it must be positive')
        unknown = sorted(set(self.columns) - set(COLUMNS))
        if unknown:
            raise ValueError(f'{self.name}: unknown columns {unknown}; known are {list(COLUMNS)}')
        lengths = {len(column) for column in self.columns.values()}
        if len(lengths) > 1:
            raise ValueError(f'{self.name}: columns of different lengths {sorted(lengths)}')
        size = lengths.pop() if lengths else 0
        for name in COLUMNS:
            if name not in self.columns:
                self.columns[name] = np.full(size, np.nan)

    def __repr__(self) -> str:
        channels = ', '.join(name for name in COLUMNS if self.has(name)) or 'nothing measured'
        return (f'Recording {self.name}, family {self.family or "not said"}: '
                f'{self.duration:.3g} s at {1.0 / self.period:.5g} Hz, {channels}')

    def __getitem__(self, column: str) -> np.ndarray:
        if column not in self.columns:
            raise KeyError(f'{self.name} has no column {column!r}; there are {list(COLUMNS)}')
        return self.columns[column]

    def __len__(self) -> int:
        return len(self.columns['voltage'])

    @property
    def driven(self) -> bool:
        """Whether it says what drives the motor: a command or a current."""
        return self.has('voltage') or self.has('current')

    @property
    def time(self) -> np.ndarray:
        """Seconds since the first sample, shape (samples,)."""
        return np.arange(len(self)) * self.period

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the end of the last one."""
        return len(self) * self.period

    def part(self, first: int, end: int) -> Recording:
        """Return the samples numbered from ``first`` to ``end``, as far as there are."""
        cut = slice(min(max(0, first - self.sequence), len(self)),
                    min(max(0, end - self.sequence), len(self)))
        return replace(self, columns={name: column[cut] for name, column in self.columns.items()},
                       start=self.start + cut.start * self.period,
                       sequence=self.sequence + cut.start)

    def has(self, column: str) -> bool:
        """Whether a column was measured at all."""
        values = self.columns[column]
        return any(bool(np.isfinite(values[k:k + _AT_ONCE]).any())
                   for k in range(0, len(values), _AT_ONCE))


PREDICTED = ('motor_position', 'load_position', 'torque', 'current', 'voltage')
"""Channels that the twin predicts, in the units of :data:`COLUMNS`."""

COMPARED = ('motor_position', 'load_position', 'torque', 'current')
"""Channels with a residual, rig minus twin, in the order of ``channel_noise``."""

BALANCES = ('drive', 'motor', 'transmission', 'load', 'controller', 'sensor', 'torque_balance')
"""Balances of the residual, each divided by its noise floor, in the order of ``balance_noise``."""


@dataclass(frozen=True)
class Predictions:
    """
    What the twin answered to one recording, sample for sample.

    ``prediction`` maps :data:`PREDICTED`, ``residual`` maps :data:`COMPARED` and :data:`BALANCES`
    to arrays of shape (samples,); sample k answers the rig's sample number ``sequence + k``.
    ``channel_noise`` has shape (4,) in rad, rad, N m, A, ``balance_noise`` (7,) in A (V of a
    voltage drive), N m, rad, N m, V, rad/s, N m: one standard deviation each, NaN where unknown.
    ``restarts``: how often the twin re-initialised its state.
    """

    name: str
    period: float
    prediction: dict[str, np.ndarray]
    residual: dict[str, np.ndarray]
    channel_noise: np.ndarray = field(default_factory=lambda: np.full(len(COMPARED), np.nan))
    balance_noise: np.ndarray = field(default_factory=lambda: np.full(len(BALANCES), np.nan))
    start: float = 0.0
    sequence: int = 0
    restarts: int = 0
    warnings: tuple[str, ...] = field(default=())

    def __len__(self) -> int:
        return len(self.prediction['voltage'])

    def part(self, first: int, end: int) -> Predictions:
        """Return the answers to samples number ``first`` to ``end``, as far as there are."""
        cut = slice(min(max(0, first - self.sequence), len(self)),
                    min(max(0, end - self.sequence), len(self)))
        return replace(self, prediction={n: v[cut] for n, v in self.prediction.items()},
                       residual={n: v[cut] for n, v in self.residual.items()},
                       start=self.start + cut.start * self.period,
                       sequence=self.sequence + cut.start)
