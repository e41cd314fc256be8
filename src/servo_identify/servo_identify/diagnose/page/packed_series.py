"""
Samples as the page carries them: whole steps of a quantum, each counted from the one before.

A step is an eighth of the noise of the sensor, so that an error of the size of the noise is drawn
as it was, also where the signal is a million times larger. Most steps have one or two digits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .words import known

OF_NOISE = 8  # steps in one standard deviation of the noise
OF_ERROR = 2000  # steps in the largest error, where no noise is known
OF_RANGE = 20000  # steps in the range of a signal with which nothing is compared
MICROSECOND = 1e-6


def packed_series(one: dict[str, Any]) -> dict[str, Any]:
    """Return a recording of ``document.series`` with packed samples."""
    channels = {name: _packed_channel(channel)
                for name, channel in (one.get('channels') or {}).items()}
    return {**one, 't': packed(one.get('t'), MICROSECOND), 'channels': channels}


def packed_equation(one: dict[str, Any]) -> dict[str, Any]:
    """Return an entry of ``document.equations`` with packed samples."""
    before, after = _numbers(one.get('before')), _numbers(one.get('after'))
    quantum = max(_largest(before), _largest(after)) / OF_ERROR
    return {**one, 't': packed(one.get('t'), MICROSECOND), 'before': packed(before, quantum),
            'after': packed(after, quantum)}


def _packed_channel(channel: dict[str, Any]) -> dict[str, Any]:
    sides = {side: _numbers(channel.get(side)) for side in ('rig', 'as_given', 'augmented')}
    rig, given, noise = sides['rig'], sides['as_given'], channel.get('noise')
    if known(noise) and noise > 0.0:
        quantum = noise / OF_NOISE
    elif len(rig) == len(given) and _largest(rig - given) > 0.0:
        quantum = _largest(rig - given) / OF_ERROR
    else:
        quantum = max(_largest(side) for side in sides.values()) / OF_RANGE
    return {**channel, 'noise': noise if known(noise) else None,
            **{side: packed(values, quantum) for side, values in sides.items()}}


def packed(values: ArrayLike | None, quantum: float) -> dict[str, Any]:
    """Return {quantum, steps}; a step is None where the value is no number."""
    values = _numbers(values)
    quantum = quantum if quantum > 0.0 else 1.0
    there = np.isfinite(values)
    steps = np.full(len(values), None, dtype=object)
    whole = np.rint(values[there] / quantum)
    steps[there] = np.diff(whole, prepend=0.0).astype(np.int64)
    return {'quantum': quantum, 'steps': steps.tolist()}


def _numbers(values: ArrayLike | None) -> np.ndarray:
    return np.array([] if values is None else values, dtype=float)


def _largest(values: np.ndarray) -> float:
    sizes = np.abs(values[np.isfinite(values)])
    return float(sizes.max()) if len(sizes) else 0.0
