"""
Keeps how the nodes, the drive and the bus are, and says what is wrong.

No bus and no clock: instants in ns are handed in, and what a device has heard.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..devices.drive_master import DriveMaster, DriveState
from .rig_health import Heartbeats, Level, RigHealth

DRIVE = 'drive'
NO_SUPPLY = ('under-voltage', 'started again')
"""What all tables call the faults of a drive whose supply is cut, or was."""
ENABLING_MAY_TAKE = 1_000_000_000


class RigWatch:
    """
    Keeps the health of the nodes, of the drive and of the bus.

    ``foreign`` says in words which frame of another driver came last, '' when none did since
    it was set to ''; ``foreign_stops`` whether the last order of another one was to give no
    torque, None while there was none; ``restarted`` names a node that booted since welcome().
    ``doubtful`` says that two nodes seem to have one id. ``sign`` is by what a node is known to
    be alive. ``lost`` says by what the drive may have lost its supply since it was set to '', in
    words.
    """

    def __init__(self, nodes: Mapping[int, str], health: RigHealth, timeout: float,
                 sign: str = 'heartbeat') -> None:
        self.health = health
        self.nodes = dict(nodes)
        self.beats = Heartbeats(self.nodes, timeout)
        self.sign = sign
        self.foreign = ''
        self.foreign_at = 0
        self.foreign_stops: bool | None = None
        self.restarted = ''
        self.lost = ''
        self.doubtful = False
        self._drive_was: DriveState | None = None
        self._disabled_since: int | None = None

    def hear_foreign(self, words: str, now: int, stops: bool | None = None) -> None:
        """Note a frame that only another driver sends, and whether it gives or takes torque."""
        if stops is not None:
            self.foreign_stops = stops
        self.foreign = words
        self.foreign_at = now
        self.health.count('bus.foreign_frames')

    def foreign_within(self, lately: int, now: int) -> bool:
        """Whether another driver was heard within the last ``lately`` ns."""
        return bool(self.foreign) and now - self.foreign_at < lately

    def booted(self, node: int) -> None:
        """Note that a node has started again."""
        self.restarted = self.name(node)
        if self.nodes[node] == DRIVE:
            self.lost = 'has started again, as after a loss of its supply,'
        self.health.count(f'nodes.{self.nodes[node]}_boots')

    def name(self, node: int) -> str:
        """Return a node in words."""
        return f'{self.nodes[node].replace("_", " ")} (node {node})'

    def silent(self, now: int) -> bool:
        """Whether a node has gone silent; says which, and that the others are heard."""
        late = self.beats.late(now)
        for node, name in self.nodes.items():
            if node in late:
                self.health.trouble(f'nodes.{name}', f'{self.name(node)} is silent: no '
                                    f'{self.sign} within {self.beats.timeout:g} s', now)
                if name == DRIVE:
                    self.lost = (f'was silent for {self.beats.timeout:g} s, so that it may have '
                                 'lost its supply,')
        return bool(late)

    def welcome(self, now: int) -> None:
        """Say that all nodes are there and run."""
        for name in self.nodes.values():
            self.health.over(f'nodes.{name}', now)
        self.health.over('nodes.restart', now)
        self.restarted = ''
        self._drive_was = None
        self._disabled_since = now

    def drive(self, master: DriveMaster, fault: str, now: int, missed: bool = False) -> bool:
        """
        Say how the drive is; whether it has just stopped following its reference.

        ``fault`` is what the drive says is wrong, in words; ``missed``: frames of the driver.
        """
        state, was = master.state, self._drive_was
        self._drive_was = state
        if state is DriveState.OPERATION_ENABLED:
            self._disabled_since = None
            if was is not state:
                self.health.over('drive.fault', now)
                self.health.over('drive.emergency', now)
                self.health.over('drive.disabled', now)
                self.health.over('drive.stopped', now)
            return False
        if self._disabled_since is None:
            self._disabled_since = now
        failed = state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)
        if failed and any(words in fault for words in NO_SUPPLY):
            self.lost = f'reported {fault}, as where its supply is cut,'
        if master.why_held:
            self.health.trouble(
                'drive.stopped', f'the drive {master.why_held} and stands in {state.words}'
                f'{f" ({fault})" if fault else ""}. It is not enabled again: find out who or what '
                'stopped it and why, then deactivate and activate the driver when it may move '
                'again', now)
        elif failed or master.held or master.given_up:
            how = 'in fault' if failed else f'stopped, and stays in {state.words}'
            words = f' ({fault})' if fault else ''
            tries = f'reset {master.tries} of {master.resets} times'
            if missed:
                tries = (f'reset {master.missed} times, and again within {master.longer_pause:g} '
                         's: frames of the driver came too late or not at all. Look at the load '
                         'of this machine and at the bus')
            if master.held:
                tries = 'not reset; deactivate and activate the driver when it may move again'
            elif master.given_up:
                tries += ', given up; deactivate and activate the driver to try again'
            self.health.trouble('drive.fault', f'the drive is {how}{words}, {tries}', now)
        elif master.enable and now - self._disabled_since > ENABLING_MAY_TAKE:
            self.health.trouble('drive.disabled', f'the drive stays in {state.words}'
                                f'{f" ({fault})" if fault else ""}', now, Level.WARN)
        return was is DriveState.OPERATION_ENABLED
