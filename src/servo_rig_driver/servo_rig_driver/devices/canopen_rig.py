"""
What the driver says to a rig and hears from it, in terms of the table of PDOs.

Commands become RPDOs; the TPDOs that a node sends after one SYNC become one answer, and the
answers of the nodes one row of values. Knows object names, no bytes and no scales.
"""

from __future__ import annotations

from contextlib import suppress
from math import nan
from typing import Any

from ..driver.limits import Mode, Setpoint
from ..driver.sample_blocks import COLUMNS
from .cia402 import Controlword
from .object_dictionary import DriveMode
from .object_units import check_units
from .pdo_table import Frame, FrameError, FrameTable, NMT_ID, sync_frame, SYNC_ID
from .sdo import write_request

NMT_STOP = 0x02
REPEAT = 10
"""Every so many SYNCs, what has not changed is said again."""

SOURCES = {
    'motor_position': ('drive', 'position_actual_value'),
    'load_position': ('load_encoder', 'position_value'),
    'torque': ('torque_sensor', 'transmitted_torque'),
    'external_torque': ('torque_sensor', 'external_torque'),
    'current': ('drive', 'motor_current'),
    'voltage': ('drive', 'applied_voltage'),
    'current_reference': ('drive', 'current_reference'),
    'temperature': ('torque_sensor', 'gearbox_temperature'),
}
"""Where each measured column comes from; NaN where the node maps no such object."""

DRIVE_MODES = {Mode.VOLTAGE: DriveMode.VOLTAGE, Mode.CURRENT: DriveMode.CURRENT,
               Mode.VELOCITY: DriveMode.VELOCITY, Mode.POSITION: DriveMode.POSITION}
TARGETS = {DriveMode.VOLTAGE: 'command_voltage', DriveMode.CURRENT: 'target_current',
           DriveMode.VELOCITY: 'target_velocity', DriveMode.POSITION: 'target_position'}


class NodeAnswer:
    """
    Gathers what one node sends after one SYNC.

    A node sends its TPDOs in the order of their numbers (their COB-IDs decide on the wire), so the
    last one closes the answer. Those that come at some SYNCs only (type above 1) keep their value.
    """

    def __init__(self, node: str, kind: int, frames: list[Frame]) -> None:
        self.node = node
        self.kind = kind
        every = [frame for frame in frames if frame.transmission_type == 1]
        self.frames = every + [frame for frame in frames if frame.transmission_type != 1]
        self.names = [name for frame in self.frames for name in frame.names]
        self.values: list[float] = [nan] * len(self.names)
        self._starts = {}
        start = 0
        for frame in self.frames:
            self._starts[frame.cob_id] = start
            start += len(frame.names)
        self._needed = {frame.cob_id for frame in every}
        self._closing = every[-1].cob_id if every else None
        self._seen: set[int] = set()
        self.counter_at = (self.names.index('sample_counter')
                           if 'sample_counter' in self.names else None)

    def take(self, frame: Frame, data: bytes) -> list[float] | None:
        """
        Take a TPDO; return the values by ``names`` when the answer is whole, else None.

        Raises FrameError for a wrong length.
        """
        values = frame.unpack(data)
        start = self._starts[frame.cob_id]
        self.values[start:start + len(values)] = values
        self._seen.add(frame.cob_id)
        if frame.cob_id != self._closing:
            return None
        whole = self._needed <= self._seen
        self._seen.clear()
        return self.values.copy() if whole else None


class RigFrames:
    """The frames of one rig as the driver uses them; raises FrameError for unfit dictionaries."""

    def __init__(self, table: FrameTable) -> None:
        check_units(table, [*SOURCES.values(), *(('drive', name) for name in TARGETS.values()),
                             ('torque_sensor', 'target_external_torque')])
        self.table = table
        self.nodes = {number: name for name, number in table.ids.items()}
        self.answers: dict[int, tuple[NodeAnswer, Frame]] = {}
        sending = []
        for node in table.ids:
            frames = [frame for frame in table.values()
                      if frame.transmitted and frame.name.startswith(node + '.')]
            if any(frame.transmission_type == 1 for frame in frames):
                answer = NodeAnswer(node, len(sending), frames)
                sending.append(answer)
                self.answers.update({frame.cob_id: (answer, frame) for frame in frames})
        self.kinds = len(sending)
        self._counted = any(answer.counter_at is not None for answer in sending)
        self._picks = [self._pick(sending, *SOURCES[name]) if name in SOURCES else None
                       for name in COLUMNS]
        status = self._pick(sending, 'drive', 'statusword')
        if status is None:
            raise FrameError('the drive maps no statusword (6041h) to a TPDO that answers SYNC')
        self._status = status
        self._control = self._receiving('drive', 'controlword')
        self._brake = self._receiving('torque_sensor', 'target_external_torque')
        self._targets = {mode: self._receiving('drive', name) for mode, name in TARGETS.items()}
        resting = [mode for mode in (DriveMode.VOLTAGE, DriveMode.CURRENT, DriveMode.VELOCITY)
                   if self._targets[mode] is not None]
        if self._control is None or not resting:
            raise FrameError('the drive maps no controlword (6040h), or none of the targets '
                             'voltage, current and velocity, to an RPDO')
        self._rest = resting[0]
        self.masters = {SYNC_ID: 'SYNC', NMT_ID: 'NMT'}
        self.masters.update({frame.cob_id: frame.name for frame in table.values()
                             if not frame.transmitted})
        self._told: tuple[Any, ...] = ()
        self._target_of: tuple[Any, ...] = ()
        self._target = b''

    @staticmethod
    def _pick(answers: list[NodeAnswer], node: str, name: str) -> tuple[int, int] | None:
        for answer in answers:
            if answer.node == node and name in answer.names:
                return answer.kind, answer.names.index(name)
        return None

    def _receiving(self, node: str, name: str) -> Frame | None:
        for frame in self.table.values():
            if not frame.transmitted and frame.name.startswith(node + '.') and name in frame.names:
                return frame
        return None

    def modes(self) -> list[Mode]:
        """Return the modes that the drive has a target for."""
        return [Mode.OFF] + [mode for mode, drive in DRIVE_MODES.items()
                             if self._targets[drive] is not None]

    def carried(self) -> dict[Mode, tuple[float, float]]:
        """Return the smallest and largest reference that the objects hold, by mode."""
        fields = {mode: self.table.field('drive', TARGETS[drive])
                  for mode, drive in DRIVE_MODES.items() if self._targets[drive] is not None}
        return {mode: (field.low * (field.factor or 1.0), field.high * (field.factor or 1.0))
                for mode, field in fields.items()}

    def writing(self, index: int, value: int) -> list[tuple[int, bytes]]:
        """Return the SDO requests that write an object on every node that lets it be written."""
        requests = []
        for node, name in self.nodes.items():
            od = self.table.dictionaries.nodes[name]
            if index in od and od[index].writable:
                requests.append(write_request(node, index, value, len(od[index]) // 8))
        return requests

    def statusword(self, answer: NodeAnswer, values: list[float]) -> int | None:
        """Return the statusword in an answer, None in that of another node."""
        kind, place = self._status
        return int(values[place]) if answer.kind == kind else None

    def command(self, number: int, control: int, point: Setpoint | None
                ) -> list[tuple[int, bytes]]:
        """
        Return the frames of tick ``number``: the set-point, the controlword, then SYNC.

        Without a set-point, or with one of mode OFF, the motor gets zero voltage (zero current or
        speed where the drive takes no voltage) and the load simulator lets go.
        """
        mode, reference, external = self._rest, 0.0, 0.0
        if point is not None and point.mode is not Mode.OFF:
            mode, reference = DRIVE_MODES[point.mode], point.reference
            external = point.external_torque
        if self._target_of != (mode, reference):
            self._target_of = mode, reference
            self._target = self._packed(self._targets[mode], {TARGETS[mode]: reference})
        frames = [(self._targets[mode].cob_id, self._target)]
        repeat = number % REPEAT == 0
        if repeat or self._told[:2] != (control, mode):
            frames.append((self._control.cob_id, self._packed(
                self._control, {'controlword': control, 'modes_of_operation': mode})))
        if external is None:
            external = self._told[2] if self._told else 0.0
        if self._brake is not None and (repeat or self._told[2:] != (external,)):
            frames.append((self._brake.cob_id, self._packed(
                self._brake, {'target_external_torque': external})))
        self._told = control, mode, external
        frames.append(sync_frame(number) if self._counted else (SYNC_ID, b''))
        return frames

    def stops(self, identifier: int, data: bytes) -> bool | None:
        """
        Whether another master's frame takes the torque away, lets it come, or neither.

        A controlword other than "enable operation" does, and NMT "stop remote node".
        """
        if identifier == NMT_ID:
            to_drive = len(data) == 2 and data[1] in (0, self.table.ids['drive'])
            return True if to_drive and data[0] == NMT_STOP else None
        if identifier != self._control.cob_id:
            return None
        with suppress(FrameError):
            control = int(self._control.decode(data)['controlword'])
            return control & 0x8F != Controlword.ENABLE_OPERATION
        return None

    def forget(self) -> None:
        """Say everything again at the next tick, as after a restart of the rig."""
        self._told = ()

    @staticmethod
    def _packed(frame: Frame, values: dict[str, float]) -> bytes:
        return frame.pack([values.get(name, 0) for name in frame.names], clamp=True)

    def row(self, answers: list[list[float]], point: Setpoint | None) -> list[float]:
        """Return one sample by COLUMNS: what was measured, and the reference it began with."""
        row = [nan if pick is None else answers[pick[0]][pick[1]] for pick in self._picks]
        if point is not None:
            if point.mode is Mode.VELOCITY:
                row[_VELOCITY] = point.reference
            elif point.mode is Mode.POSITION:
                row[_POSITION] = point.reference
        unread = self._picks[_VOLTAGE] is None and self._rest is DriveMode.VOLTAGE
        if unread and (point is None or point.mode in (Mode.OFF, Mode.VOLTAGE)):
            row[_VOLTAGE] = point.reference if point else 0.0
        return row


_VELOCITY = COLUMNS.index('reference_velocity')
_POSITION = COLUMNS.index('reference_position')
_VOLTAGE = COLUMNS.index('voltage')
