"""One set-point, what it is a reference for, and the limits that hold it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from math import inf


class Mode(IntEnum):
    """What a set-point is a reference for; the numbers are those of Command.msg."""

    OFF = 0
    VOLTAGE = 1
    CURRENT = 2
    VELOCITY = 3
    POSITION = 4


UNITS = {Mode.VOLTAGE: 'V', Mode.CURRENT: 'A', Mode.VELOCITY: 'rad/s', Mode.POSITION: 'rad'}


@dataclass(frozen=True)
class Setpoint:
    """One set-point: ``instant`` in ns, ``reference`` in the mode's unit, N m or None."""

    instant: int
    mode: Mode
    reference: float
    external_torque: float | None


@dataclass(frozen=True)
class Limits:
    """Largest magnitudes that may reach the rig; positions from ``lower`` to ``upper``."""

    voltage: float
    current: float
    velocity: float
    lower: float
    upper: float
    external_torque: float

    def range(self, mode: Mode) -> tuple[float, float]:
        """Return the smallest and the largest reference of a mode, in the mode's unit."""
        if mode is Mode.POSITION:
            return self.lower, self.upper
        if mode is Mode.OFF:
            return 0.0, 0.0
        size = {Mode.VOLTAGE: self.voltage, Mode.CURRENT: self.current,
                Mode.VELOCITY: self.velocity}[mode]
        return -size, size

    def within(self, carried: Mapping[Mode, tuple[float, float]]) -> Limits:
        """Return these limits held to what a drive's frames carry, by mode; no entry: any."""
        def size(mode: Mode, own: float) -> float:
            low, high = carried.get(mode, (-inf, inf))
            return min(own, -low, high)

        low, high = carried.get(Mode.POSITION, (-inf, inf))
        return replace(
            self, voltage=size(Mode.VOLTAGE, self.voltage),
            current=size(Mode.CURRENT, self.current),
            velocity=size(Mode.VELOCITY, self.velocity),
            lower=min(max(self.lower, low), high), upper=min(max(self.upper, low), high))

    def held(self, point: Setpoint) -> Setpoint:
        """Return a set-point within these limits: itself where it is."""
        low, high = self.range(point.mode)
        top, torque = self.external_torque, point.external_torque
        if low <= point.reference <= high and (torque is None or -top <= torque <= top):
            return point
        return replace(point, reference=min(max(point.reference, low), high),
                       external_torque=None if torque is None else min(max(torque, -top), top))
