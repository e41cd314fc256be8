"""
The player: drives a rig by the set-points of one excitation family, then stops.

    python -m servo_rig_driver.record.player_node speed_ladder --setting highest=0.6 \\
        --ros-args -r __ns:=/rig

It waits until the rig's samples come, sends its set-points in blocks a little ahead of their
instants, and leaves. Whoever ends it early leaves the rig with what is left of one block. One that
stood still, as when it was stopped or the machine slept, ends: the motor came to zero meanwhile,
and would begin again in the middle of a motion. So does one whose wall clock is set meanwhile: the
driver takes no set-point any more whose stamp means another instant than it says.
"""

from __future__ import annotations

import argparse
from array import array
import sys
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import numpy as np
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.utilities import remove_ros_args

from servo_twin_msgs.msg import Command, Encoder

from ..driver import message_conversion as conversion
from ..driver.limits import Mode, UNITS
from ..driver.setpoints import SECOND
from ..driver.steady_clock import SteadyClock
from ..emulated.excitation_families import ExcitationError, FAMILIES, family
from ..ending import Ending
from ..given_parameters import cannot_start, judge_remaps, UNFIT
from ..ros_start import start_ros
from ..timer_clock import STEADY

BLOCK = 0.2  # s of set-points in one message
AHEAD = 0.3  # s that a block leaves before its first instant
STOOD_STILL = 1.0  # s behind the instant of a block from which on none is sent any more
TAKEN = 1.0  # s for the driver to take the last set-point of one that ends early
STEP = 0.1  # s by which the wall clock may be set meanwhile
REPORT_EVERY = 1.0  # s
MOST = 20_000_000  # set-points of one excitation, hours at 1 kHz


class Player(Node):
    """Plays a reference and an external torque, one set-point every ``period`` s, once."""

    def __init__(self, mode: Mode, period: float, reference: np.ndarray,
                 external_torque: np.ndarray) -> None:
        super().__init__('player')
        self.heard = False
        self.sent = 0
        self.trouble = ''
        self._ended = False
        self._mode, self._period = mode, period
        self._reference, self._torque = reference, external_torque
        self._start = 0
        self._steady = SteadyClock(self._ros_now)
        judge_remaps(self, {'command': Command, 'encoder': Encoder})
        reliable = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
        self._topic = self.create_publisher(Command, 'command', reliable)
        self._samples = self.create_subscription(Encoder, 'encoder', self._hear, reliable)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_timer(BLOCK / 4.0, self._play, clock=STEADY)
        self.create_timer(REPORT_EVERY, self._report, clock=STEADY)

    @property
    def done(self) -> bool:
        """Whether the last set-point has been sent and its instant has passed."""
        return self._ended and self._now() >= self._instant(len(self._reference))

    def _instant(self, number: int) -> int:
        return self._start + round(number * self._period * SECOND)

    def _now(self) -> int:
        return self._steady.now()

    def _ros_now(self) -> int:
        return self.get_clock().now().nanoseconds

    def _hear(self, message: Encoder) -> None:
        self.heard = True
        self.destroy_subscription(self._samples)

    def _play(self) -> None:
        if not self.heard or not self._topic.get_subscription_count():
            return
        if not self._start:
            self._steady = SteadyClock(self._ros_now)
            self._start = self._now() + round(AHEAD * SECOND)
        stepped = self._steady.stepped() / SECOND
        if abs(stepped) > STEP:
            self.trouble = f'the clock was set by {stepped:+.1f} s'
            self._switch_off(self._now())
            self._topic.wait_for_all_acked(Duration(seconds=TAKEN))
            return
        size = max(1, round(BLOCK / self._period))
        while self.sent < len(self._reference):
            instant = self._instant(self.sent)
            late = (self._now() - instant) / SECOND
            if late < -AHEAD:
                return
            if late > STOOD_STILL:
                self.trouble = f'stood still for {late:.1f} s'
                return
            part = slice(self.sent, self.sent + size)
            message = Command(mode=int(self._mode), period=self._period)
            message.header.stamp = conversion.to_time(instant)
            message.reference = array('d', self._reference[part].tobytes())
            message.external_torque = array('d', self._torque[part].tobytes())
            self._topic.publish(message)
            self.sent += len(message.reference)
        if not self._ended:
            self._switch_off(self._instant(self.sent))
            self._ended = True

    def _switch_off(self, instant: int) -> None:
        off = Command(mode=int(Mode.OFF), reference=[0.0])
        off.header.stamp = conversion.to_time(instant)
        self._topic.publish(off)

    def _report(self) -> None:
        """Say how far it is: of one that hangs nothing is heard."""
        length, sent = len(self._reference) * self._period, self.sent * self._period
        said = f'{sent:.1f} s of {length:.1f} s are sent' if self.sent else 'waiting for a rig'
        name = self.get_fully_qualified_name()
        report = DiagnosticArray(status=[DiagnosticStatus(
            level=DiagnosticStatus.OK, name=f'{name}: playing', hardware_id=name, message=said)])
        report.header.stamp = conversion.to_time(self._ros_now())
        self._diagnostics.publish(report)


def eased(wave: np.ndarray, period: float) -> np.ndarray:
    """Return a wave that grows from zero in its first half second and fades in its last."""
    time = np.arange(len(wave)) * period
    left = time[-1] - time
    return wave * np.clip(np.minimum(time, left) / min(0.5, 0.25 * time[-1]), 0.0, 1.0)


def spoken(name: str, mode: Mode, reference: np.ndarray, torque: np.ndarray) -> str:
    """Return what is going to be played: quantity, largest size and unit; ``torque`` in N m."""
    said = (f'playing {name}: {mode.name.lower()} of up to {np.abs(reference).max():.4g} '
            f'{UNITS[mode]}')
    pull = np.abs(torque).max()
    return said + (f', external torque of up to {pull:.4g} N m' if pull else '')


def _above_zero(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < 1e9:
        raise argparse.ArgumentTypeError(f'{text!r} s is no time above 0 and below 1e9')
    return value


def _setting(text: str) -> tuple[str, float]:
    name, _, value = text.partition('=')
    try:
        return name, float(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f'{text!r} must read NAME=NUMBER') from None


def main(arguments: list[str] | None = None) -> int:
    """Play one family; 1 when no rig was there, 2 when it cannot be played."""
    arguments = sys.argv[1:] if arguments is None else arguments
    parser = argparse.ArgumentParser(description='Drives a rig by one excitation family.')
    parser.add_argument('family', choices=list(FAMILIES))
    parser.add_argument('--setting', type=_setting, action='append', default=[],
                        metavar='NAME=VALUE',
                        help='a setting of the family, such as amplitude=0.5')
    parser.add_argument('--mode', choices=[mode.name.lower() for mode in Mode][1:],
                        help='what the reference is of; left out: what the family is meant for')
    parser.add_argument('--duration', type=_above_zero, help='s; left out: that of the family')
    parser.add_argument('--period', type=_above_zero, default=1e-3, help='s between set-points')
    parser.add_argument('--wait', type=_above_zero, default=30.0, help='s to wait for the rig')
    options = parser.parse_args(remove_ros_args(['player', *arguments])[1:])
    chosen = family(options.family)
    duration = options.duration or chosen.duration
    try:
        if not 2 <= duration / options.period <= MOST:
            raise ValueError(f'{duration:g} s at {options.period:g} s from one set-point to the '
                             f'next are {duration / options.period:.4g} of them; there are 2 to '
                             f'{MOST}')
        time = np.arange(0.0, duration, options.period)
        reference, torque = chosen.waves(time, dict(options.setting))
    except (ExcitationError, ValueError) as problem:
        print(f'player: {problem}', file=sys.stderr)
        return 2
    mode = Mode[(options.mode or chosen.mode).upper()]
    reference, torque = eased(reference, options.period), eased(torque, options.period)
    print(spoken(options.family, mode, reference, torque), flush=True)
    ending = Ending()
    start_ros(arguments)
    try:
        node = Player(mode, options.period, reference, torque)
    except UNFIT as problem:
        return cannot_start('player', problem)
    begin = monotonic()
    try:
        while not node.done:
            rclpy.spin_once(node, timeout_sec=0.2)
            if ending.asked:
                return 130
            if node.trouble:
                print(f'player: {node.trouble}; the rest is not played', file=sys.stderr)
                return 1
            if not node.sent and monotonic() - begin > options.wait:
                print(f'player: no rig took a set-point within {options.wait:g} s: '
                      + ('its driver does not listen' if node.heard else 'no samples came'),
                      file=sys.stderr)
                return 1
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
