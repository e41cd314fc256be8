"""What one recording of one machine holds: named columns in SI units, and what they are of."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

COLUMNS = {
    'voltage': 'V',
    'current_reference': 'A',
    'current': 'A',
    'motor_position': 'rad',
    'load_position': 'rad',
    'torque': 'N m',
    'external_torque': 'N m',
    'reference_position': 'rad',
    'reference_velocity': 'rad/s',
    'temperature': 'degC',
}
"""Columns besides the time `t`, with their units; one that was not measured is NaN throughout."""


@dataclass(frozen=True)
class Recording:
    """
    One recording, sampled evenly.

    ``columns`` maps every name of :data:`COLUMNS` to an array of shape (samples,), float64; sample
    k was taken at ``start + k * period``. ``voltage`` and the references are held from sample k to
    sample k + 1, all others are measured at sample k. Positions in rad, each on its own shaft.
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

    def __getitem__(self, column: str) -> np.ndarray:
        return self.columns[column]

    def __len__(self) -> int:
        return len(self.columns['voltage'])

    @property
    def time(self) -> np.ndarray:
        """Seconds since the first sample, shape (samples,)."""
        return np.arange(len(self)) * self.period

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the end of the last one."""
        return len(self) * self.period

    def has(self, column: str) -> bool:
        """Whether a column was measured at all."""
        return bool(np.isfinite(self.columns[column]).any())
