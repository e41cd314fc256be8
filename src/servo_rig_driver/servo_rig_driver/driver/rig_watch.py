"""
Listens to what is not a sample: heartbeats, emergencies, other drivers; and says what is wrong.

No bus and no clock: frames and instants in ns are handed in.
"""

from __future__ import annotations

from ..devices.canopen_rig import RigFrames
from ..devices.cia402 import DriveMaster, DriveState
from ..devices.emergency_codes import words
from ..devices.pdo_table import HEARTBEAT_ID
from ..devices.sdo import RESPONSE_ID, write_response
from .rig_health import Heartbeats, Level, RigHealth

EMERGENCY_ID = 0x80
ENABLING_MAY_TAKE = 1_000_000_000


class RigWatch:
    """
    Keeps the health of the nodes, of the drive and of the bus.

    ``foreign`` says in words which frame of another driver came last, '' when none did since
    it was set to ''; ``restarted`` names a node that booted since welcome(); ``stored`` holds
    (node, index) of objects that a node has taken, or refused, to store, and ``twice`` the nodes
    that answered one such request twice since it was emptied.
    """

    def __init__(self, frames: RigFrames, health: RigHealth, timeout: float) -> None:
        self.health = health
        self.beats = Heartbeats(frames.nodes, timeout)
        self.foreign = ''
        self.foreign_at = 0
        self.restarted = ''
        self.stored: set[tuple[int, int]] = set()
        self.twice: set[int] = set()
        self._masters = frames.masters
        self._nodes = frames.nodes
        self._drive_was: DriveState | None = None
        self._disabled_since: int | None = None

    def take(self, identifier: int, data: bytes, now: int) -> None:
        """Take a frame that is no answer to SYNC."""
        node = identifier & 0x7F
        function = identifier & ~0x7F
        if identifier in self._masters:
            self.foreign = f'{self._masters[identifier]} (0x{identifier:03X})'
            self.foreign_at = now
            self.health.count('bus.foreign_frames')
        elif node not in self._nodes:
            return
        elif function == HEARTBEAT_ID and len(data) == 1:
            if data[0] == Heartbeats.BOOT_UP:
                self.restarted = self.name(node)
                self.health.count(f'nodes.{self._nodes[node]}_boots')
            self.beats.beat(node, data[0], now)
        elif function == RESPONSE_ID:
            self._response(node, data, now)
        elif function == EMERGENCY_ID and len(data) == 8:
            self._emergency(node, data, now)
        elif function in (HEARTBEAT_ID, EMERGENCY_ID):
            self.health.event('nodes.wrong_length', f'{self.name(node)} sent 0x{identifier:03X} '
                              f'with {len(data)} bytes, expected '
                              f'{1 if function == HEARTBEAT_ID else 8}; left out', now)

    def _response(self, node: int, data: bytes, now: int) -> None:
        response = write_response(data)
        if response is None:
            return
        index, abort = response
        if (node, index) in self.stored:
            self.twice.add(node)
        self.stored.add((node, index))
        if abort is not None:
            self.health.event('nodes.refusal', f'{self.name(node)} refuses object {index:04X}h, '
                              f'abort code 0x{abort:08X}; it keeps its own value', now)

    def name(self, node: int) -> str:
        """Return a node in words."""
        return f'{self._nodes[node].replace("_", " ")} (node {node})'

    def _emergency(self, node: int, data: bytes, now: int) -> None:
        code = data[0] | data[1] << 8
        who = self._nodes[node]
        key = 'drive.emergency' if who == 'drive' else f'nodes.{who}_emergency'
        if code == 0:
            self.health.over(key, now)
            return
        self.health.count(f'{key}_frames')
        self.health.trouble(key, f'{self.name(node)} reports emergency 0x{code:04X} '
                            f'({words(code)}), error register 0x{data[2]:02X}', now)

    def silent(self, now: int) -> bool:
        """Whether a node has gone silent; says which, and that the others are heard."""
        late = self.beats.late(now)
        for node, name in self._nodes.items():
            if node in late:
                self.health.trouble(f'nodes.{name}', f'{self.name(node)} is silent: no heartbeat '
                                    f'within {self.beats.timeout:g} s', now)
        return bool(late)

    def welcome(self, now: int) -> None:
        """Say that all nodes are there and run."""
        for name in self._nodes.values():
            self.health.over(f'nodes.{name}', now)
        self.health.over('nodes.restart', now)
        self.restarted = ''
        self._drive_was = None
        self._disabled_since = now

    def drive(self, master: DriveMaster, now: int) -> bool:
        """Say how the drive is; whether it has just stopped following its reference."""
        state, was = master.state, self._drive_was
        self._drive_was = state
        if state is DriveState.OPERATION_ENABLED:
            self._disabled_since = None
            if was is not state:
                self.health.over('drive.fault', now)
                self.health.over('drive.emergency', now)
                self.health.over('drive.disabled', now)
            return False
        if self._disabled_since is None:
            self._disabled_since = now
        if state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE):
            tries = f'reset {master.tries} of {master.resets} times'
            if master.given_up:
                tries += ', given up; deactivate and activate the driver to try again'
            self.health.trouble('drive.fault', f'the drive is in fault, {tries}', now)
        elif master.enable and now - self._disabled_since > ENABLING_MAY_TAKE:
            self.health.trouble('drive.disabled', f'the drive stays in {state.words}', now,
                                Level.WARN)
        return was is DriveState.OPERATION_ENABLED
