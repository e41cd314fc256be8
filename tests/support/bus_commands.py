"""
What a drive follows by the frames that it has heard: an oracle of commands, beside the driver.

The frames are read by `struct`, with the scales of the vendors' documents; those of a moteus by
its registers.
"""

from __future__ import annotations

from functools import partial
from math import isnan, tau
from struct import unpack_from
from typing import Any

from bus_listener import BusListener

from servo_rig_driver.devices.moteus_registers import MoteusTable
from servo_rig_driver.driver.limits import Mode

EXTENDED, FD = 1 << 31, 1 << 32
STEPS = {'robstride': dict.fromkeys(Mode, 1.4e-3), 'cybergear': dict.fromkeys(Mode, 1.4e-3),
         'cubemars': {Mode.VELOCITY: 100.0 / 4095, Mode.POSITION: 25.0 / 65535,
                      Mode.CURRENT: 36.0 / 4095}}
"""By how much a drive's commands go on from one to the next, where that is coarse."""


class Followed(BusListener):
    """
    Keeps what a drive follows after each frame: ``said`` holds (mode, reference at the load).

    ``of`` are the driver's parameters. A drive that has inputs beside a mode follows the one of
    its mode, whichever frame came last.
    """

    def __init__(self, name: str, channel: str, of: dict[str, Any]) -> None:
        self.said: list[tuple[Mode, float]] = []
        self._read = {'canopen': self._canopen, 'odrive': self._odrive, 'moteus': self._moteus,
                      'robstride': partial(self._extended, 88.0, 34.0),
                      'cybergear': partial(self._extended, 60.0, 24.0),
                      'cubemars': self._cubemars}[name]
        self._ratio = of['device.ratio']
        self._ampere = of['device.torque_constant']
        self._mode, self._inputs = 0, {}
        self._registers = MoteusTable('moteus') if name == 'moteus' else None
        super().__init__(channel, self._take)

    def _take(self, identifier: int, data: bytes) -> None:
        self.said += self._read(identifier, data)

    def beyond(self, mode: Mode, limit: float, first: int = 0, step: float = 0.0) -> list[float]:
        """Return the references of a mode beyond a limit, since entry ``first``."""
        return [value for which, value in self.said[first:]
                if which is mode and abs(value) > limit + step + 1e-6]

    def _canopen(self, identifier: int, data: bytes) -> list[tuple[Mode, float]]:
        if identifier == 0x201:
            self._mode = data[2] if len(data) > 2 else self._mode
            self._mode -= 256 * (self._mode > 127)
        elif identifier == 0x301:
            self._inputs[-1], self._inputs[-2] = unpack_from('<ii', data)
        elif identifier in (0x401, 0x501):
            self._inputs[9 if identifier == 0x401 else 8], = unpack_from('<i', data)
        else:
            return []
        which, scale = {8: (Mode.POSITION, 1e-7), 9: (Mode.VELOCITY, 1e-6),
                        -1: (Mode.VOLTAGE, 1e-6), -2: (Mode.CURRENT, 1e-6)
                        }.get(self._mode, (Mode.OFF, 0.0))
        return [(which, scale * self._inputs.get(self._mode, 0))]

    def _odrive(self, identifier: int, data: bytes) -> list[tuple[Mode, float]]:
        command = identifier - 32
        if command == 0x0B:  # Set_Controller_Mode
            self._mode, = unpack_from('<I', data)
        elif command in (0x0C, 0x0D, 0x0E) and len(data) >= 4:  # position, velocity, torque
            self._inputs[{0x0C: 3, 0x0D: 2, 0x0E: 1}[command]], = unpack_from('<f', data)
        else:
            return []
        given, turns = self._inputs.get(self._mode, 0.0), tau / self._ratio
        which, scale = {1: (Mode.CURRENT, 1.0 / self._ampere), 2: (Mode.VELOCITY, turns),
                        3: (Mode.POSITION, turns)}.get(self._mode, (Mode.OFF, 0.0))
        return [(which, scale * given)]

    def _moteus(self, identifier: int, data: bytes) -> list[tuple[Mode, float]]:
        if identifier & 0xFFFF != 0x8001:
            return []
        told = self._registers.parse(data)[0]
        if told.get('mode') != 10:
            return []
        if told['kp_scale'] == 0.0:
            return [(Mode.CURRENT, told['feedforward_torque'] / self._ampere / self._ratio)]
        if told['command_velocity'] == 0.0 and not isnan(told['command_position']):
            return [(Mode.POSITION, told['command_position'] * tau)]
        return [(Mode.VELOCITY, told['command_velocity'] * tau)]

    def _extended(self, speeds: float, torques: float, identifier: int, data: bytes
                  ) -> list[tuple[Mode, float]]:
        # frames of RobStride and CyberGear; the ranges of speed and torque are those of a model
        if not identifier & EXTENDED or identifier & 0xFF != 1 or identifier >> 24 & 0x1F != 1:
            return []
        position, velocity, kp, kd = unpack_from('>HHHH', data)
        return self._five(4.0 * tau * (position / 65535 - 0.5), speeds * (velocity / 65535 - 0.5),
                          kp, kd, torques * ((identifier >> 8 & 0xFFFF) / 65535 - 0.5))

    def _cubemars(self, identifier: int, data: bytes) -> list[tuple[Mode, float]]:
        if identifier != 1 or data[:7] == b'\xff' * 7:
            return []
        bits = int.from_bytes(data, 'big')
        return self._five(25.0 * ((bits >> 48) / 65535 - 0.5),
                          100.0 * ((bits >> 36 & 0xFFF) / 4095 - 0.5), bits >> 24 & 0xFFF,
                          bits >> 12 & 0xFFF, 36.0 * ((bits & 0xFFF) / 4095 - 0.5))

    def _five(self, position: float, velocity: float, kp: int, kd: int, torque: float
              ) -> list[tuple[Mode, float]]:
        if kp:
            return [(Mode.POSITION, position)]
        if kd:
            return [(Mode.VELOCITY, velocity)]
        return [(Mode.CURRENT, torque / self._ampere / self._ratio)]
