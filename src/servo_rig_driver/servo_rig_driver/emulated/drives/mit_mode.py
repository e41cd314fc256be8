"""An emulated actuator in MIT mode, by its model's table: each frame to it is answered once."""

from __future__ import annotations

from math import inf
import struct

from ...can_bus.unix_frames import EXTENDED
from ...devices.drive_settings import DriveSettings
from ...devices.mit_table import MitTable
from ...devices.pdo_table import FrameError
from .. import rig_sampling
from ..emulated_bench import Bench
from .one_drive import OneDrive, Send

LOOP_RATE = 10_000.0  # Hz; assumed, the manuals do not give it
RESET, RUN = 0, 2  # of the field `mode`


class EmulatedMit(OneDrive):
    """One actuator; readings are rounded to the bits of its table."""

    def __init__(self, bench: Bench, table: MitTable, settings: DriveSettings, send: Send) -> None:
        super().__init__(bench, settings, LOOP_RATE, send)
        self.table = table
        self.power_on()
        self._ids = {'drive': settings.node, 'host': settings.host}

    def power_on(self) -> None:
        """Stand without torque; without a watchdog too, where it is told over the bus."""
        self.running = False
        self.faults = 0
        self._five = dict.fromkeys(('position', 'velocity', 'kp', 'kd', 'torque'), 0.0)
        if 'watchdog' in self.table.frames:
            self.watchdog = inf

    @property
    def gives_torque(self) -> bool:
        """Whether the actuator runs."""
        return self.running

    def command(self) -> tuple[float, ...]:
        """Return the five numbers of the law."""
        if not self.running:
            return (rig_sampling.OFF,)
        five = self._five
        return (rig_sampling.IMPEDANCE_MODE, five['position'], 0.0, five['velocity'], five['kp'],
                five['kd'], five['torque'])

    def hear(self, identifier: int, data: bytes, now: float) -> bool:
        """Take a frame for this actuator, and answer it."""
        if bool(identifier & EXTENDED) != self.table.extended:
            return False
        known = self._known(identifier & ~EXTENDED, data)
        if known is None:
            return False
        name, told = known
        if name == 'control':
            if self.running:
                self._five.update((key, told[key]) for key in self._five)
        elif name == 'watchdog':
            self.watchdog = told['time'] / self.table.watchdog_rate
        elif name == 'enable':
            self.running = not self.faults
            self._five = dict.fromkeys(self._five, 0.0)
        elif name in ('stop', 'clear'):
            self.running = False
            # a model without a frame of its own for it clears its fault by leaving the mode
            if name == 'clear' or self._clears_by_stop:
                self.faults = 0
        if name == 'turns':
            self._send_flagged('turns_told', angle=int.from_bytes(
                struct.pack('<f', self.load_angle), 'little'), status=0)
        else:
            self._answer()
        return True

    @property
    def _clears_by_stop(self) -> bool:
        ids = {'drive': 1, 'host': 0}
        return self.table.frames['stop'].pack(ids) == self.table.frames['clear'].pack(ids)

    def _known(self, identifier: int, data: bytes) -> tuple[str, dict[str, float]] | None:
        # frames of constants first: a command of five numbers may look like any of them
        for name in sorted(self.table.commands, key=lambda one: one == 'control'):
            try:
                told = self.table.frames[name].unpack(identifier, data)
            except FrameError:
                self.refused += 1
                return None
            if told is not None and told.get('drive') == self.settings.node:
                return name, told
        return None

    def _answer(self) -> None:
        out = self.step()
        span = self.table.ranges['position']
        angle = self.load_angle
        if self.table.wraps:
            angle = (angle - span.low) % (span.high - span.low) + span.low
        self._send_flagged(
            'feedback', mode=RUN if self.running else RESET, fault=self.faults, position=angle,
            velocity=self.load_speed, torque=out[rig_sampling.CURRENT] * self.torque_per_ampere,
            temperature=out[rig_sampling.TEMPERATURE])

    def _send_flagged(self, name: str, **values: float) -> None:
        identifier, data = self.table.frames[name].pack(self._ids | values)
        self.send([(identifier | (EXTENDED if self.table.extended else 0), data)])

    def own(self, identifier: int, data: bytes) -> str:
        """Return that an actuator sends a feedback of this id."""
        if bool(identifier & EXTENDED) != self.table.extended:
            return ''
        try:
            told = self.table.frames['feedback'].unpack(identifier & ~EXTENDED, data)
        except FrameError:
            return ''
        return '' if told is None or told.get('drive') != self.settings.node else 'actuator'

    def beat(self, now: float) -> None:
        """Say nothing: it speaks when it is asked."""

    def starved(self) -> None:
        """Leave the running mode for want of commands, without a fault."""
        self.running = False

    def fail(self, code: int) -> None:
        """Stop with fault bits, or with an error code, as the model has them."""
        self.faults = code
        self.running = False
