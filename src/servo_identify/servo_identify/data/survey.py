"""What a recording of any length shows at a glance, gathered part by part."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.parts import parts_of
from servo_twin.recording.recording import COLUMNS, Recording

from .fill_values import fill_value_of, without
from .long_bags import Long
from .signals import ANGLES, TURN

FEWEST_COUNTS = 20  # whole numbers in an angle from which on they are counts
_BESIDE = 4  # samples before and behind a jump that say how the angle goes on
_FAR = 10.0  # times the largest tenth of all steps, and those beside it, is a jump
_SEAM = 4  # samples of a part that the next one is to see, so that each jump is seen once
_SENSED = (*ANGLES, 'torque', 'current')
_COUNTED = 5000  # samples of which the different ones are counted


@dataclass(frozen=True)
class Survey:
    """
    A recording at a glance.

    ``measured`` are the channels that hold a number, ``lost`` the share of samples of each angle
    that holds none, ``whole_numbers`` the angles that look like counts, ``wrapped`` the round, in
    rad, of those that jump back by it. ``jumps`` tells of another angle how often it jumps within
    a sample, and after how many s first. ``still`` of ``parts`` show no motion. ``command`` and
    ``current`` are their least and largest value. ``at_limit`` is the share of commands at the
    servo's limit. ``fills`` are numbers that stand for none, and in how many rows, by channel.
    """

    name: str
    start: float
    period: float
    samples: int
    warnings: tuple[str, ...]
    parts: int
    still: int
    measured: frozenset[str]
    lost: dict[str, float]
    whole_numbers: tuple[str, ...]
    wrapped: dict[str, float]
    jumps: dict[str, tuple[int, float]]
    command: tuple[float, float]
    current: tuple[float, float]
    at_limit: float
    fills: dict[str, tuple[float, int]]

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the end of the last one."""
        return self.samples * self.period

    @property
    def moves(self) -> bool:
        """Whether any part shows a motion."""
        return self.still < self.parts


def survey(one: Long, servo: Servo) -> Survey:
    """Look at all samples of a recording, part by part."""
    known, whole, counts = Counter[str](), dict.fromkeys(ANGLES, True), set[str]()
    wrapped, ranges = dict[str, float](), dict.fromkeys(('voltage', 'current'), (np.inf, -np.inf))
    jumps, ends = dict[str, tuple[int, float]](), dict.fromkeys(ANGLES, np.empty(0))
    still = at_limit = parts = 0
    fills = dict[str, tuple[float, int]]()
    limit = limit_of(servo)
    for part in parts_of(one):
        parts += 1
        none = {name: fill_value_of(part[name], name not in ANGLES) for name in _SENSED}
        for name, fill in none.items():
            if fill:
                fills[name] = fill[0], fill[1] + fills.get(name, (0.0, 0))[1]
        angles = {name: without(part[name], none[name]) for name in ANGLES}
        known.update({name: int(np.isfinite(part[name]).sum()) for name in COLUMNS})
        still += not any(len(x) and np.ptp(x) > 0.0 for x in angles.values())
        for name, values in angles.items():
            whole[name] = whole[name] and bool(np.all(values == np.round(values)))
            if whole[name] and len(np.unique(values[:_COUNTED])) > FEWEST_COUNTS:
                counts.add(name)
            if turn := _turn_of(name, values, servo):
                wrapped[name] = turn
            elif len(at := jumps_of(np.concatenate([ends[name], part[name]]))):
                begins = part.start - one.start + (at[0] - len(ends[name])) * part.period
                count, first = jumps.get(name, (0, float(begins)))
                jumps[name] = count + len(at), first
            ends[name] = part[name][-_SEAM:]
        for name, (least, most) in ranges.items():
            x = part[name][np.isfinite(part[name])]
            ranges[name] = (float(np.min(x, initial=least)), float(np.max(x, initial=most)))
        at_limit += _at_limit(part, limit)
    return Survey(
        one.name, one.start, one.period, len(one), one.warnings, parts, still,
        frozenset(name for name in COLUMNS if known[name]),
        {name: 1.0 - known[name] / max(1, len(one)) for name in ANGLES},
        tuple(name for name in ANGLES if whole[name] and name in counts),
        wrapped, jumps,
        ranges['voltage'], ranges['current'],
        at_limit / max(1, known['voltage']), fills)


def wrapped_in(part: Recording, servo: Servo) -> dict[str, float]:
    """Return the round, rad, of those angles of a part that jump back by it."""
    turns = {name: _turn_of(name, part[name][np.isfinite(part[name])], servo) for name in ANGLES}
    return {name: turn for name, turn in turns.items() if turn}


def _turn_of(name: str, angle: np.ndarray, servo: Servo) -> float:
    return 0.0 if servo.straight(name) else round_of(angle)


def round_of(angle: np.ndarray) -> float:
    """
    Return the round, rad, by which an angle without NaN jumps back from end to end; 0 for none.

    Where that is not one turn, the jumps must be as large as all else that the angle moves, and
    the angle must go on behind each as it came.
    """
    if len(angle) <= 2 * _BESIDE + 2:
        return 0.0
    span = float(np.ptp(angle))
    if 0.9 * TURN < span < 1.02 * TURN:
        far = np.abs(np.diff(angle)) > TURN / 4.0  # a jump that was resampled has two such steps
        return TURN if 0.0 < np.mean(far) < 0.2 else 0.0
    jumps = angle[2:] - angle[:-2]  # two steps each, for the same reason
    far = np.abs(jumps) > 0.9 * span
    beside = np.convolve(far, np.ones(3), 'same') > 0.0
    if not 0.0 < np.mean(far) < 0.05 or np.max(np.abs(jumps[~beside])) > 0.2 * span:
        return 0.0
    at = np.flatnonzero(far[_BESIDE:-_BESIDE]) + _BESIDE
    slope = (angle[at] - angle[at - _BESIDE] + angle[at + 2 + _BESIDE] - angle[at + 2]) / (
        2 * _BESIDE)
    goes_on = slope * jumps[at] < 0.0
    if not len(at) or np.mean(goes_on) < 0.7:
        return 0.0
    return float(np.median(np.abs(jumps[at] - 2.0 * slope)))


def jumps_of(angle: np.ndarray) -> np.ndarray:
    """
    Return the rows before which an angle jumps: (jumps,), none of which a shaft can do.

    A step counts that is far larger than most and than those before and behind it: what moves
    gathers speed. The last count of an encoder is no such step.
    """
    steps = np.abs(np.diff(angle))
    moved = steps[steps > 0.0]  # of NaN neither
    if len(moved) < FEWEST_COUNTS:
        return np.empty(0, dtype=int)
    far = np.flatnonzero(steps > _FAR * np.quantile(moved, 0.9))
    far = far[(far > 0) & (far < len(steps) - 2)]
    least = steps[far] / _FAR
    there = (steps[far + 1] < least) & (steps[far - 1] < least)
    spike = (np.abs(angle[far + 2] - angle[far]) < least) & (steps[far - 1] < least) & (
        steps[far + 2] < least)
    return far[there | spike] + 1  # of a row that is NaN beside it nothing is known


def limit_of(servo: Servo) -> float:
    """Return the limit of the command, V; inf where the servo has none."""
    return float(servo.values.get('controller.limit') or np.inf)


def share_at_limit(one: Recording, servo: Servo) -> tuple[float, float]:
    """Return the limit of the command, V, and the share of the samples that are at it."""
    limit, known = limit_of(servo), int(np.isfinite(one['voltage']).sum())
    return limit, _at_limit(one, limit) / known if known else 0.0


def _at_limit(one: Recording, limit: float) -> int:
    return int(np.sum(np.abs(one['voltage']) >= 0.999 * limit))
