"""What becomes of a command: set-points that wait to be played, or a reason why not."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

from .command_sources import CommandSources
from .limits import Mode
from .rig_health import RigHealth
from .rig_link import RigLink
from .setpoints import Receipt, Refused, SetpointPlayer


class CommandIntake:
    """
    Hands commands to the player while the rig runs, and tells the health what it does not take.

    ``modes`` are those that the drive takes.
    """

    def __init__(self, link: RigLink, player: SetpointPlayer, modes: Sequence[Mode],
                 health: RigHealth, sources: CommandSources) -> None:
        self._link, self._player, self._modes = link, player, modes
        self._health, self._sources = health, sources

    def take(self, start: int, mode: int, period: float, reference: Sequence[float],
             external_torque: Sequence[float]) -> None:
        """
        Queue a block of set-points, unless the rig stands, several command, or it cannot be.

        Arguments as of :meth:`SetpointPlayer.add`; ``start`` in ns, ``period`` in s.
        """
        now = self._link.now()
        self._health.count('command.received')
        if self._link.state != 'streaming':
            self._health.event('command.not_taken', 'command dropped: the rig does not run, the '
                               f'driver is {self._link.state}', now)
            return
        if self.several(now):
            return
        stepped = self._link.stepped() * 1e-9
        if abs(stepped) > self._player.timeout:  # stamps would mean other instants than they say
            self._player.clear()
            self._health.event('command.clock', f'command dropped, motor at zero: the clock was '
                               f'set by {stepped:+.1f} s, or the machine slept; clean the driver '
                               'up and configure it again', now)
            return
        try:
            if mode in Mode.__members__.values() and mode not in self._modes:
                raise Refused(f'the drive does not take mode {Mode(mode).name}; it takes '
                              f'{[mode.name for mode in self._modes]}')
            if not start and mode != Mode.OFF:
                raise Refused('header.stamp is not set; it is the instant of the first set-point '
                              'by the ROS clock, `stamp: now` for ros2 topic pub')
            no_position = self._link.sampler.device.no_position
            if mode == Mode.POSITION and no_position:
                raise Refused(f'position {reference[0] if len(reference) else nan:.4g} rad; '
                              f'{no_position}')
            receipt = self._player.add(start, mode, period, reference, external_torque, now)
        except Refused as error:
            self._health.event('command.refused', f'command refused: {error}', now)
            return
        self._tell(receipt, (now - start) * 1e-9, now)

    def _tell(self, receipt: Receipt, age: float, now: int) -> None:
        """Say what was limited, and what was too old; ``age`` is that of the block, s."""
        if receipt.clamped:
            self._health.event('command.clamped', f'command limited: {receipt.note}', now)
        if receipt.too_old:
            self._health.event('command.too_old', f'{receipt.too_old} of {receipt.received} '
                               'set-points were older than command_timeout = '
                               f'{self._player.timeout:g} s on arrival (the block began '
                               f'{age:.3f} s ago)', now)

    def several(self, now: int) -> bool:
        """Have the motor at zero while several publish commands; return whether they do."""
        several = self._sources.several(now)
        if several:
            self._player.clear()
        return several
