"""The node that plays a run on a rig, watches the limits, and brings the motor to rest."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from math import isfinite
from pathlib import Path
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import numpy as np
import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.task import Future

from servo_twin.nodes.given_parameters import judge_remaps
from servo_twin.nodes.message_conversion import SECOND, to_instant, to_time
from servo_twin.nodes.message_conversion import TOPICS as SAMPLES
from servo_twin.nodes.ros_start import start_ros
from servo_twin.nodes.timer_clock import STEADY
from servo_twin_msgs.msg import Command, Current, Encoder, Torque

from .procedures import Run
from .run_clock import RunClock
from .run_limits import Guard, LimitError, Limits
from .setpoint_profiles import ACCELERATION, eased

BLOCK = 0.1  # s of set-points in one message
AHEAD = 0.2  # s that a block leaves before its first instant
SETTLE = 0.1  # s that is recorded behind the last set-point
STOOD_STILL = 1.0  # s behind the instant of a block from which on none is sent any more
STEP = 0.1  # s by which the wall clock may be set during a run
SILENCE = 0.3  # s without a load angle after which the rig is taken for lost
HOMING = 0.3  # rad/s
CLOSE = 0.02  # rad from where the experiment began that need no way home
_UNLOOPED = ('torque', 'current', 'no samples', 'the driver')
"""Troubles in which no control loop is asked to brake."""
_MODES = {'voltage': Command.VOLTAGE, 'current': Command.CURRENT, 'velocity': Command.VELOCITY,
          'position': Command.POSITION}


class Stopped(RuntimeError):
    """An experiment that ended early: interrupted, at a limit, or without a rig."""


class Performer(Node):
    """
    Plays runs one after the other on the rig of a namespace.

    A context: leaving it brings the motor to rest. ``interrupt`` may be called from a signal
    handler; the run that is played then raises Stopped. Raises SharedName for remaps that cannot
    be.
    """

    def __init__(self, namespace: str, limits: Limits) -> None:
        start_ros()
        super().__init__('experiment', namespace=namespace)
        judge_remaps(self, {'command': Command, **SAMPLES})
        self.limits = limits
        self.period = self._heard = 0.0
        self.guard: Guard | None = None
        self.trouble = self._interrupted = ''
        self.stands = 'the motor is at rest'  # after a run, in words
        self._moving = self._watching = False
        reliable = QoSProfile(depth=2000, reliability=ReliabilityPolicy.RELIABLE)
        self._command = self.create_publisher(Command, 'command', reliable)
        self.create_subscription(Encoder, 'encoder', self._encoder, reliable)
        self.create_subscription(Torque, 'torque', self._torque, reliable)
        self.create_subscription(Current, 'current', self._current, reliable)
        self._failure, self._due = '', 0
        self._recording: dict[str, set[str]] = {}
        self.create_subscription(DiagnosticArray, '/diagnostics', self._diagnosis, 100)
        self._executor = EventsExecutor()
        self._executor.add_node(self)

    def __enter__(self) -> Performer:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.rest()
        finally:
            self._executor.remove_node(self)
            self.destroy_node()
            rclpy.try_shutdown()

    def interrupt(self, why: str = 'interrupted') -> None:
        """Have the run that is played, or the next one, end with Stopped."""
        self._interrupted = why

    def begin(self, patience: float) -> None:
        """Wait for the rig; where its load stands is where travel counts from."""
        if not self._wait(lambda: self._interrupted or self.guard is not None and not self._failure
                          and self._command.get_subscription_count(), patience):
            raise Stopped(f'no rig within {patience:g} s: ' + (
                'no samples came' if self.guard is None else
                self._failure or 'its driver takes no commands'))
        self._heed()

    def recorded(self, bag: Path, patience: float) -> None:
        """Wait until the recorder of a bag says that it takes down all samples."""
        wanted = {f'messages {self.resolve_topic_name(topic)}'
                  for topic in ('encoder', 'torque', 'current')}
        if not self._wait(lambda: self._interrupted or wanted <= self._recording.get(
                str(bag), set()), patience):
            raise Stopped(f'{bag}: the recorder took no samples within {patience:g} s')
        self._heed()

    def home(self) -> None:
        """Bring the load back to where the experiment began, if it is elsewhere."""
        angle = self.guard.origin - self.guard.angle
        if abs(angle) < CLOSE:
            return
        speed = min(HOMING, self.limits.speed / 2.0, (ACCELERATION * abs(angle)) ** 0.5 / 2.0)
        wanted = np.append(np.full(round(abs(angle) / speed / self.period), speed),
                           np.zeros(round(2.0 * speed / ACCELERATION / self.period)))
        reference = np.sign(angle) * eased(wanted, self.period)
        self._play('velocity', reference, np.zeros(len(reference)), lambda share: None)

    def perform(self, run: Run, told: Callable[[float], None]) -> None:
        """
        Play a run; ``told`` hears which share of it is done, 0 to 1.

        Raises LimitError where the rig samples at another period, Stopped for what ended the run
        before its time; the motor is off then, and :attr:`stands` says more.
        """
        if abs(self.period - run.period) > 1e-9:
            raise LimitError(f'{run.name} has a set-point every {run.period:g} s, the rig samples '
                             f'every {self.period:g} s; choose --rate {1.0 / self.period:g}')
        reference = run.reference + (self.guard.angle if run.mode == 'position' else 0.0)
        self._play(run.mode, reference, run.external_torque, told)

    def rest(self) -> None:
        """Brake where a loop can do it; switch off until the load stands still, at most 3 s."""
        self._watching = False
        if not self._moving:
            return
        if not self.trouble.startswith(_UNLOOPED):
            self._say('velocity', np.zeros(round(0.4 / self.period)))
            self._wait(lambda: abs(self.guard.speed) < 0.01, 0.4)
        until = monotonic() + 3.0
        while monotonic() < until:
            self._say('off', np.zeros(1))
            if self._wait(self.guard.at_rest, 0.05):
                self._wait(lambda: False, SETTLE)
                break
        else:
            self.stands = 'the motor is off; the load was not seen at rest'
        self._moving = False

    def _play(self, mode: str, reference: np.ndarray, torque: np.ndarray,
              told: Callable[[float], None]) -> None:
        self._heed()
        size, sent = max(1, round(BLOCK / self.period)), 0
        clock = RunClock(self._now)
        start = clock.now() + round(AHEAD * SECOND)
        end = start + round(len(reference) * self.period * SECOND)
        self.trouble, self._watching, self._moving, self._heard = '', True, True, monotonic()
        try:
            while (now := clock.now()) < end + SETTLE * SECOND:
                if abs(stepped := clock.stepped()) > STEP:  # the driver takes nothing any more
                    raise Stopped(f'the clock was set by {stepped:+.1f} s')
                while sent < len(reference):
                    instant = start + round(sent * self.period * SECOND)
                    if (late := (now - instant) / SECOND) < -AHEAD:
                        break
                    if late > STOOD_STILL:  # the motor would begin in the middle of its motion
                        raise Stopped(f'this process stood still for {late:.1f} s')
                    part = slice(sent, sent + size)
                    self._publish(_MODES[mode], instant, reference[part], torque[part])
                    sent += size
                self._wait(lambda: bool(self.trouble or self._interrupted), BLOCK / 2.0)
                self._heed()
                told(min(1.0, max(0.0, 1.0 - (end - now) / (end - start))))
        except Stopped:
            self.rest()
            raise
        self._watching = False

    def _heed(self) -> None:
        """Raise Stopped for what is wrong."""
        if not self.trouble and self._moving and self._watching and (
                monotonic() - self._heard > SILENCE):
            self.trouble = f'no samples with a load angle for {SILENCE:g} s'
        if self.trouble or self._interrupted:
            raise Stopped(self.trouble or self._interrupted)

    def _say(self, mode: str, reference: np.ndarray) -> None:
        kind = _MODES.get(mode, Command.OFF)
        self._publish(kind, self._now(), reference, np.zeros(len(reference)))

    def _publish(self, mode: int, instant: int, reference: np.ndarray,
                 torque: np.ndarray) -> None:
        message = Command(mode=mode, period=self.period or 1e-3)
        message.header.stamp = to_time(instant)
        message.reference = array('d', reference.astype(float).tobytes())
        message.external_torque = array('d', torque.astype(float).tobytes())
        self._command.publish(message)

    def _encoder(self, message: Encoder) -> None:
        positions = message.load_position
        self._heard = monotonic() if any(map(isfinite, positions)) else self._heard
        if self.guard is None:
            if not isfinite(positions[-1]):
                return
            self.period = message.period
            self.guard = Guard(self.limits, positions[-1], message.period)
        stamp = to_instant(message.header.stamp)
        if abs(stamp - self._due) > 2.5e9 * message.period:
            self.guard.forget()
        self._due = stamp + round(len(positions) * message.period * SECOND)
        for position in positions:
            self._note(self.guard.see(position=position))

    def _torque(self, message: Torque) -> None:
        if self.guard is not None:
            for torque in message.torque:
                self._note(self.guard.see(torque=torque))

    def _current(self, message: Current) -> None:
        if self.guard is not None:
            for current in message.current:
                self._note(self.guard.see(current=current))

    def _diagnosis(self, message: DiagnosticArray) -> None:
        """Heed what the driver of this rig says of its drive, and a recorder of its bag."""
        for status in message.status:
            if status.name.endswith(': recording'):
                facts = {pair.key: pair.value for pair in status.values}
                self._recording[facts.get('output', '')] = set(facts)
        of_driver = [status for status in message.status
                     if status.hardware_id == f'{self.get_namespace()}/driver']
        if of_driver:
            wrong = [s.message for s in of_driver if s.level >= DiagnosticStatus.ERROR]
            self._failure = f'the driver says: {wrong[0]}' if wrong else ''
            self._note(self._failure)

    def _note(self, said: str) -> None:
        if said and self._watching and not self.trouble:
            self.trouble = said

    def _now(self) -> int:
        return self.get_clock().now().nanoseconds

    def _wait(self, condition: Callable[[], object], seconds: float) -> bool:
        """Run callbacks until a condition holds or the time is over; say whether it holds."""
        done, limit = Future(), monotonic() + seconds

        def look() -> None:
            if not done.done() and (condition() or monotonic() > limit):
                done.set_result(None)

        timer = self.create_timer(0.005, look, clock=STEADY)
        self._executor.spin_until_future_complete(done, seconds + 1.0)
        self.destroy_timer(timer)
        return bool(condition())
