"""Which numbers of a servo are free, between which bounds, and on what scale they matter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from servo_twin.description.nearest_name import or_what
from servo_twin.physics.element_names import split_name
from servo_twin.physics.servo import Servo, ServoError

SURE = 2.0
"""Standard deviations that a tolerance of the servo file stands for."""


@dataclass(frozen=True)
class Freedom:
    """
    The free numbers of a servo.

    ``names`` are paths, with ``[i]`` behind those of a row; ``index`` is where each stands in the
    flat vector `theta`; ``low`` and ``high`` bound it; ``scale`` is the size of a change that
    matters, in the unit of the number. All of shape (numbers,).
    """

    names: tuple[str, ...]
    index: np.ndarray
    low: np.ndarray
    high: np.ndarray
    scale: np.ndarray

    def __len__(self) -> int:
        return len(self.names)


NOTHING_FREE = Freedom((), *(np.array([], dtype=t) for t in (int, float, float, float)))
"""Where only starts are estimated, or nothing at all."""


def freedom_of(servo: Servo, free: Sequence[str], bounds: Mapping[str, tuple[float, float]] | None,
               tolerance: bool = True) -> Freedom:
    """
    Free parameters by path: ``mechanism.stiffness``, a row ``effects.te.cosine``, ``...[3]``.

    Bounds are those of the declaration, cut by the tolerance of the servo file (unless
    ``tolerance`` is false) and by ``bounds``. Raises ServoError for an unknown path, an index
    beyond its row and bounds that leave nothing.
    """
    if not free:
        raise ServoError(f'{servo.name}: no parameter is free; there are {list(servo.values)}')
    slots, declared, theta = servo.slots(), dict(servo.declarations()), servo.theta
    bounds = dict(bounds or {})
    names, index, low, high, scale = [], [], [], [], []
    for given in free:
        path, element = split_name(given)
        if path not in slots:
            near = [p for p in slots if p.rpartition('.')[0] == path.rpartition('.')[0]]
            raise ServoError(f'{servo.name}: there is no parameter {path!r} to free; '
                             f'{or_what(path, near or slots)}')
        slot, row = slots[path], declared[path].row
        size = slot.stop - slot.start
        elements = range(size) if element is None else [element]
        for i in elements:
            if i >= size or (element is not None and not row):
                raise ServoError(f'{servo.name}: {given}: {path} holds {size} number(s)')
            name = f'{path}[{i}]' if row else path
            if name in names:
                raise ServoError(f'{servo.name}: {name} is freed twice')
            edges = [declared[path].bounds]
            if tolerance and name in servo.tolerance:
                edges.append(servo.tolerance[name])
            edges += [bounds[key] for key in (path, name) if key in bounds]
            below, above = max(e[0] for e in edges), min(e[1] for e in edges)
            if not below < above:
                raise ServoError(f'{servo.name}: {name}: bounds leave [{below:g}, {above:g}]')
            names.append(name)
            index.append(slot.start + i)
            low.append(below)
            high.append(above)
            default = declared[path].default
            typical = default[0] if row else default
            scale.append(_scale(theta[slot.start + i], typical, below, above))
    unknown = [p for p in bounds if p not in names and p not in slots]
    if unknown:
        raise ServoError(f'{servo.name}: bounds are given for {unknown}; free are {names}')
    return Freedom(tuple(names), np.array(index), np.array(low), np.array(high), np.array(scale))


def _scale(value: float, default: float, low: float, high: float) -> float:
    size = abs(value) or abs(default)
    width = high - low
    if size == 0.0:
        size = 0.01 * width if np.isfinite(width) else 1.0
    return min(size, width)


def tolerated(servo: Servo, freedom: Freedom) -> np.ndarray:
    """Return what the tolerances say of each free number, (numbers,): scale^2 over variance."""
    known = np.zeros(len(freedom))
    for n, name in enumerate(freedom.names):
        span = servo.tolerance.get(name)
        if span is not None and span[1] > span[0]:
            known[n] = (SURE * freedom.scale[n] / (0.5 * (span[1] - span[0])))**2
    return known
