"""
One tick: what goes out with a SYNC, and what comes back.

The hot path of the driver: everything here runs at the rate of SYNC, in the link's thread.
"""

from __future__ import annotations

from collections import deque

from ..can_bus.bus_port import Frames
from ..devices.canopen_rig import RigFrames
from ..devices.cia402 import DriveMaster, DriveState
from ..devices.pdo_table import FrameError
from .answer_joining import SampleJoiner
from .rig_health import Level, RigHealth
from .rig_watch import RigWatch
from .sample_blocks import BlockBuilder
from .setpoints import Setpoint, SetpointPlayer

_MAY_PUSH = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE,
             DriveState.FAULT_REACTION_ACTIVE, DriveState.UNKNOWN)


class Sampler:
    """
    Makes the frames of each tick and joins the answers to samples.

    A set-point is asked for only while the drive is enabled; in all other states the frames carry
    zero. When the drive falls out of that state, what was queued is dropped.
    """

    def __init__(self, frames: RigFrames, player: SetpointPlayer, master: DriveMaster,
                 watch: RigWatch, health: RigHealth) -> None:
        self.frames = frames
        self.player = player
        self.master = master
        self.watch = watch
        self.health = health
        self.blocks: BlockBuilder | None = None
        self.statusword = 0
        self.samples = 0
        self._joiner = SampleJoiner(frames.kinds)
        self._begun: deque[tuple[int, Setpoint | None]] = deque()
        self._expired, self._ended = player.expired, player.ended
        self._lost = 0
        self._unasked = 0

    def restart(self) -> None:
        """Forget SYNCs that nobody will answer, and the state of a drive that was away."""
        self._joiner.restart()
        self._begun.clear()
        self.frames.forget()
        self.master.forget()
        self.player.clear()
        self.statusword = 0

    @property
    def waiting(self) -> int:
        """Number of SYNCs not answered in full."""
        return self._joiner.waiting

    @property
    def down(self) -> bool:
        """Whether the drive has told that it gives no torque."""
        return self.master.state not in _MAY_PUSH

    def tick(self, number: int, instant: int, now: int) -> Frames:
        """Return the frames of tick ``number``, due at ``instant`` ns and sent ``now``."""
        control = self.master.step(self.statusword, now * 1e-9)
        point = self.player.at(instant, now) if self.master.enabled else None
        self._joiner.ask(number)
        self._begun.append((number, point))
        return self.frames.command(number, control, point)

    def rest(self, number: int, control: int) -> Frames:
        """Return the frames that bring the motor to zero at once, without a SYNC."""
        self.player.clear()
        return self.frames.command(number, control, None)[:-1]

    def take(self, received: Frames, now: int) -> None:
        """Take the frames that came in, in their order."""
        answers = self.frames.answers
        for identifier, data in received:
            known = answers.get(identifier)
            if known is None:
                self.watch.take(identifier, data, now)
                continue
            answer, frame = known
            try:
                values = answer.take(frame, data)
            except FrameError as error:
                self.health.event('samples.wrong_length', f'{error}; left out', now)
                continue
            if values is None:
                continue
            word = self.frames.statusword(answer, values)
            if word is not None:
                self.statusword = word
            place = answer.counter_at
            sample = self._joiner.answer(answer.kind, values,
                                         None if place is None else int(values[place]))
            if sample is not None:
                self._pass_on(*sample)

    def _pass_on(self, number: int, answers: list[list[float]]) -> None:
        begun, point = self._begun.popleft()
        while begun < number:
            begun, point = self._begun.popleft()
        self.samples += 1
        self.blocks.add(number, self.frames.row(answers, point))

    def check(self, now: int) -> None:
        """Say what the last ticks brought to light; called some ten times a second."""
        if self.watch.drive(self.master, now):
            self.player.clear()
        lost = self._joiner.lost + (self.blocks.dropped if self.blocks else 0)
        if lost > self._lost:
            self.health.count('samples.unanswered', lost - self._lost)
            self.health.event('samples.lost', f'{lost - self._lost} samples were asked for and '
                              'never came', now)
            self._lost = lost
        if self._joiner.unasked > self._unasked:
            self.health.count('samples.unasked_answers', self._joiner.unasked - self._unasked)
            self.health.event('samples.unasked', 'answers came that no SYNC had asked for', now)
            self._unasked = self._joiner.unasked
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
