"""
One tick: what goes out with a request, and what comes back.

The hot path of the driver: everything here runs at the rate of samples, in the link's thread.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from ..can_bus.bus_port import BusPort, Frames
from ..devices.device import Device
from ..devices.drive_master import DriveMaster, MAY_PUSH, Order, WENT_DOWN
from ..devices.pdo_table import FrameError
from .answer_joining import Sample, SampleJoiner
from .limits import Mode, Setpoint
from .order_joining import OrderJoiner
from .rig_health import Level, RigHealth
from .rig_watch import RigWatch
from .sample_blocks import BlockBuilder
from .setpoints import SetpointPlayer

LOOK, LOOKS = 500_000_000, 3
"""Within each of so many looks of so many ns half of the requests are answered twice: no chance,
and not what a drive says at once that was held up."""


class Sampler:
    """
    Makes the frames of each tick and joins the answers to samples.

    A set-point is asked for only while the drive is enabled; in all other states the frames carry
    zero. When the drive falls out of that state, what was queued is dropped. Where answers name
    no request, ``patience`` is for how many ns they may be behind.
    """

    def __init__(self, device: Device, player: SetpointPlayer, master: DriveMaster,
                 watch: RigWatch, health: RigHealth, patience: int = 0) -> None:
        self.device = device
        self.player = player
        self.master = master
        if not device.tells_restart:
            master.went_down = WENT_DOWN
        self.watch = watch
        self.health = health
        self.blocks: BlockBuilder | None = None
        self.samples = 0
        self._joiner = SampleJoiner(device.kinds)
        if device.on_request:
            self._joiner = OrderJoiner(device.kinds, patience, min(patience, device.silence))
        self._instant = self._ticked = 0
        self._begun: deque[tuple[int, Setpoint | None]] = deque()
        self._order = Order.NO_TORQUE
        self._raised: int | None = None  # the last request that let the drive have torque
        self._told = -1  # the last request that was answered
        self._expired, self._ended, self._limited = player.expired, player.ended, player.limited
        self._lost = self._unasked = self._held_back = self._held_back_said = 0
        self._asked = self._looks = 0
        self._looked = 0, 0, 0  # when, and the requests and unasked answers until then

    def restart(self) -> None:
        """Forget requests that nobody will answer, and the state of a drive that was away."""
        self._joiner.restart()
        self._begun.clear()
        self._looks = 0
        self.device.forget()
        self.master.forget()
        self.player.clear()

    @property
    def waiting(self) -> int:
        """Number of requests not answered in full."""
        return self._joiner.waiting

    @property
    def down(self) -> bool:
        """Whether the drive has told that it gives no torque, since it was let have some."""
        since = self._raised is None or self._told > self._raised
        return since and self.device.settled and self.device.state not in MAY_PUSH

    def proves_down(self, port: BusPort, now: Callable[[], int], wanted: Callable[[], bool]
                    ) -> bool:
        """Whether it is `down`, and tells so again where it may have told that before."""
        if not self.down:
            return False
        if self.device.proves_down(port, now, wanted) and self.down:
            return True
        self.restart()
        return False

    @property
    def owes(self) -> bool:
        """Whether the drive was let have torque, and has yet to tell that it gives none."""
        return self._raised is not None and not self.down

    def let_go(self) -> None:
        """Take the drive for one without torque, or for one that another driver leads."""
        self._raised = None

    def tick(self, number: int, instant: int, now: int) -> Frames | None:
        """
        Return the frames of tick ``number``, due at ``instant`` ns and sent ``now``.

        None: no sample is asked for, since the drive is behind with its answers. Another order
        than that before goes out in any case.
        """
        order = self.master.step(self.device.state, now * 1e-9, self.device.emergency_stop,
                                 self.device.starved(now), self.device.missed,
                                 self.device.loss(now))
        elapsed = min(now - self._ticked, instant - self._instant)  # not what nobody could use
        self._ticked, self._instant = now, instant
        if not self._joiner.may_ask(elapsed) and order is self._order:
            self._held_back += 1
            return None
        self._order = order
        if order is Order.ENABLE:
            self._raised = number
        self._asked += 1
        follows = self.master.enabled and not self.device.doubted(now)
        point = self.player.at(instant, now) if follows else None
        if point is not None and point.mode is Mode.POSITION and self.device.no_position:
            point = self._no_position(point, now)
        self._pass_on(self._joiner.ask(number))
        self._begun.append((number, point))
        return self.device.ask(number, order, point, now)

    def _no_position(self, point: Setpoint, now: int) -> None:
        """Drop what is played and waits: the drive would take it for another position."""
        self.player.clear()
        self.health.event('command.no_position', 'command dropped, motor at zero: '
                          f'{point.reference:.4g} rad cannot be held; {self.device.no_position}',
                          now)

    def answered_twice(self, now: int) -> bool:
        """Whether requests have been answered twice for LOOKS: another node has come."""
        at, asked, unasked = self._looked
        if now - at >= LOOK:
            self._looked = now, self._asked, self._joiner.unasked
            twice = 0 < self._asked - asked <= 2 * (self._joiner.unasked - unasked)
            self._looks = self._looks + 1 if twice else 0
        return self._looks >= LOOKS

    def judged(self, frames: Frames, now: int) -> tuple[Frames, int | None]:
        """
        Return the frames of the last tick as they may go out ``now``, and until when; None: ever.

        The machine may have stood still since they were made: a set-point that has become too old
        meanwhile is taken out of them.
        """
        number, point = self._begun[-1]
        if point is None or point.mode is Mode.OFF:
            return frames, None
        until = self.player.expires(point)
        if now <= until:
            return frames, until
        self._begun[-1] = number, None
        self.device.unsent()
        return self.device.ask(number, self._order, None, now), None

    def withdraw(self, number: int, now: int) -> None:
        """Note that the bus was too slow for the set-point of a tick, and left the tick out."""
        self._pass_on(self._joiner.withdraw(number))
        self.device.unsent()  # a change of mode, or of the controlword, went with it
        self.health.count('command.late_on_bus')
        self.health.event('command.late_on_bus', 'the bus held a set-point up until it was older '
                          f'than command_timeout = {self.player.timeout:g} s; it was left out',
                          now)

    def rest(self, number: int, now: int) -> Frames:
        """Return the frames that bring the motor to zero at once, without a request."""
        self.player.clear()
        return self.device.rest(number, now)

    def take(self, received: Frames, now: int) -> None:
        """Take the frames that came in, in their order."""
        for identifier, data in received:
            try:
                answer = self.device.take(identifier, data, now)
            except FrameError as error:
                self.health.event('samples.wrong_length', f'{error}; left out', now)
                continue
            if answer is not None:
                self._pass_on(self._joiner.answer(*answer))

    def _pass_on(self, samples: list[Sample]) -> None:
        for number, answers in samples:
            begun, point = self._begun.popleft()
            while begun < number:
                begun, point = self._begun.popleft()
            self.samples += 1
            self._told = number
            self.device.answered(number)
            self.blocks.add(number, self.device.row(answers, point))

    def check(self, now: int) -> None:
        """Say what the last ticks brought to light; called some ten times a second."""
        if self.watch.drive(self.master, self.device.fault, now, self.device.missed):
            self.player.clear()
        lost = self._joiner.lost + (self.blocks.dropped if self.blocks else 0)
        if lost > self._lost:
            self.health.count('samples.unanswered', lost - self._lost)
            self.health.event('samples.lost', f'{lost - self._lost} samples were asked for and '
                              'never came', now)
            self._lost = lost
        if self._held_back > self._held_back_said:
            held_back = self._held_back - self._held_back_said
            self.health.count('samples.not_asked', held_back)
            self.health.event('samples.held_back', f'{held_back} samples were not asked for: the '
                              'drive was behind with its answers, or one was lost', now)
            self._held_back_said = self._held_back
        if self._joiner.unasked > self._unasked:
            self.health.count('samples.unasked_answers', self._joiner.unasked - self._unasked)
            self.health.event('samples.unasked', 'answers came that nobody had asked for', now)
            self._unasked = self._joiner.unasked
        if self.player.limited > self._limited:
            self._limited = self.player.limited
            self.health.event('command.clamped', 'command limited: a limit was set below what '
                              'waits', now)
        if self.player.expired > self._expired:
            self._expired = self.player.expired
            self.health.count('command.ran_out')
            self.health.trouble('command.expired', 'no set-point younger than command_timeout = '
                                f'{self.player.timeout:g} s is left, and the last one was no '
                                'rest; the motor is at zero', now, Level.WARN)
        elif self.player.playing:
            self.health.over('command.expired', now)
        if self.player.ended > self._ended:
            self._ended = self.player.ended
            self.health.count('command.ended')
            self.health.over('command.expired', now)
