"""What a drive that is asked for each sample has to know of its machine."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from .device import DeviceError


@dataclass(frozen=True)
class DriveSettings:
    """
    One drive on its bus and on its machine.

    ``node`` and ``host`` are the ids of drive and driver, ``ratio`` the turns of the motor for one
    of the load, ``torque_constant`` in N m/A at the motor. ``kp`` (N m/rad), ``kd`` and ``brake``
    (N m s/rad) are gains at the load for drives that take them with each command. ``rest_speed``,
    rad/s at the load, ends a quick stop; ``watchdog``, s, is after what silence the drive stops by
    itself, for drives that are told so over the bus. ``retry`` in s; ``joint`` is the load's name.
    """

    node: int
    host: int
    ratio: float
    torque_constant: float
    rest_speed: float
    kp: float = 0.0
    kd: float = 0.0
    brake: float = 0.0
    watchdog: float = 0.1
    retry: float = 0.5
    joint: str = 'load'

    def __post_init__(self) -> None:
        """Raise DeviceError for what a data sheet has to say and nobody has."""
        for name, unit in (('ratio', ''), ('torque_constant', ' N m/A'), ('rest_speed', ' rad/s')):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0.0):
                raise DeviceError(f'device.{name} = {value:g}{unit}; it must be given, above 0')

    @property
    def torque_per_ampere(self) -> float:
        """Torque at the load for one ampere, N m/A."""
        return self.torque_constant * self.ratio
