"""Numbers as an encoder gives them, no angle yet: counts, and rounds that wrap around."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from servo_twin.physics.servo import Servo

from .finding import Finding
from .signals import ANGLES, TURN
from .survey import FEWEST_COUNTS, round_of

_LARGEST = 1 << 20  # counts of a turn: what counts further counts turns as well
_NEAR = 0.05  # of a power of two, within which a range is that of a counter


def check_counts(path: Path, columns: Mapping[str, np.ndarray], servo: Servo) -> None:
    """
    Raise ValueError for an angle of whole numbers alone, which is counts; says what to give.

    ``columns`` in rad, or m of what moves straight, of shape (rows,), before they are resampled.
    """
    for name in ANGLES:
        values = columns.get(name, np.empty(0))
        values = values[np.isfinite(values)]
        if (values != np.round(values)).any() or len(np.unique(values)) <= FEWEST_COUNTS:
            continue
        low, high = values.min(), values.max()
        said = (f'{path}: {name} holds whole numbers alone, from {low:.0f} to {high:.0f}: counts '
                'of an encoder? ')
        if servo.straight(name):
            raise ValueError(f"{said}Say what one count is, as in the header '{name} [0.5 um]', "
                             'or by unit: 0.5 um in a mapping file')
        turn = _power_of_two(high - low)
        wraps = bool(round_of(values))
        unit = f'1/{turn if wraps and 0 < turn <= _LARGEST else 4096} rev'
        raise ValueError(
            f"{said}Give the counts of a turn, as in the header '{name} [{unit}]', or by unit: "
            f'{unit} in a mapping file' + (
                '. They jump back from end to end, which a mapping file mends as well: '
                f'wraps: {turn or round(high - low + 1)}' if wraps else ''))


def _power_of_two(span: float) -> int:
    """Return the power of two that a counter of this range ends at, 0 for none."""
    near = 2 ** round(np.log2(span + 1.0))
    return near if abs((span + 1.0) / near - 1.0) < _NEAR else 0


def wrapped_findings(name: str, wrapped: Mapping[str, float]) -> Iterator[Finding]:
    """Yield what is to be said of the angles of a recording that wrap around, by round in rad."""
    for column, turn in wrapped.items():
        yield Finding(
            'red', f'{name}: {column} stays within one turn and jumps back by it: an encoder that '
            'wraps around at each turn.' if turn == TURN else
            f'{name}: {column} jumps back by {turn:.4g} rad, all of its range: a counter that '
            'wraps around.', 'unwrap it (numpy.unwrap), or give the round in the mapping, such as '
            'wraps: 360 of degrees, wraps: 65536 of counts')
