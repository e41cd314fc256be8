"""
The adapter: a node between what another driver publishes and the samples of a rig.

    adapter --ros-args -p mapping:=ros2_control -p joint:=hip -r __ns:=/hip

It publishes `encoder`, `torque` and `current` as the driver does, so that twin, recorder and
identification run beside a robot whose drives they never touch. It commands nothing.
"""

from __future__ import annotations

from math import ceil
from pathlib import Path
import sys
from time import monotonic
from typing import Any

from ament_index_python.packages import get_package_share_directory
import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.task import Future

from servo_twin_msgs.msg import Current, Encoder, Event, Torque

from ..driver.encoder_leaps import EncoderLeaps
from ..driver.health_report import Diagnoser
from ..driver.message_conversion import SampleMessages
from ..driver.rig_health import RigHealth
from ..driver.sample_blocks import SampleBlock
from ..ending import Ending
from ..free_output import free_output
from ..given_parameters import cannot_start, judge_remaps, refuse_unknown, UNFIT
from ..home_path import at_home
from ..namesake import Namesake, PROCESS
from ..ros_start import start_ros
from ..timer_clock import STEADY
from . import adapter_parameters
from .adapter_findings import AdapterFindings
from .mapped_columns import MappedColumns, MappingError, read_mapping
from .message_field import FieldError, stamp_of
from .robot_topics import OVERRIDABLE, RobotTopics
from .sample_stream import SampleStream, SECOND

GROUPS = ('topics', 'samples', 'clock')
LOOK_EVERY = 0.1
SAMPLES = {'encoder': Encoder, 'torque': Torque, 'current': Current}


class Adapter(Node):
    """
    Topics, parameters and health; the work is done by SampleStream.

    Raises MappingError, and UnknownParameter for a parameter that it does not have.
    """

    def __init__(self) -> None:
        super().__init__('adapter')
        self.settings = of = adapter_parameters.declare(self)
        refuse_unknown(self)
        self.mapped = mapping_of(of.mapping, of.joint)
        judge_remaps(self, dict.fromkeys(self.mapped.topics, 'of the robot') | SAMPLES
                     | {'events': Event})
        self.health = RigHealth()
        self._leaps = EncoderLeaps(self.health, of.largest_acceleration)
        period = round(SECOND / of.rate if of.rate else SECOND * self.mapped.period)
        self.stream = SampleStream(self.mapped, period, round(of.listen_time * SECOND),
                                   round(of.delay * SECOND), of.block_size, self._publish)
        self._messages = SampleMessages(
            of.frame_id or f'{self.get_namespace()}/base_link'.strip('/'))
        self._outputs: list = []
        self._topics = RobotTopics(self, self.mapped.topics, self.mapped.leading, of.silence,
                                   self.health, self._take)
        self._found = AdapterFindings(self.stream, self.health, self.resolve_topic_name)
        self._counted = 0.0
        self.finished: Future = Future()
        self._namesake = Namesake(self, self._give_way)
        self._diagnoser = Diagnoser(self, self.health, self._facts, GROUPS)
        self.create_timer(LOOK_EVERY, self._look, clock=STEADY)

    # Topics.

    def _take(self, topic: str, message: Any, number: int | None) -> None:
        watch = self._found.watches[topic]
        try:
            watch.take(self.stream.put(topic, message, stamp_of(message), self._now()), number)
        except FieldError as error:
            watch.lacks(error)

    def _publish(self, block: SampleBlock) -> None:
        if not self._outputs:
            depth = max(1000, ceil(self.settings.history / (block.period
                                                            * self.settings.block_size)))
            self._outputs = [self.create_publisher(
                kind, name, QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE),
                qos_overriding_options=OVERRIDABLE) for name, kind in SAMPLES.items()]
        self._leaps.take(block)
        for topic, message in zip(self._outputs, self._messages.fill(block), strict=True):
            topic.publish(message)

    # Health.

    def _now(self) -> int:
        return self.get_clock().now().nanoseconds

    def _look(self) -> None:
        now = self._now()
        self._topics.look(now)
        if monotonic() - self._counted >= self.settings.diagnostics_period:
            self._counted = monotonic()
            self._found.tell(self._topics.publishers(), now)
        self._found.tell_time(now, self.settings.silence)
        self._diagnoser.look(now, self.settings.diagnostics_period)

    def _give_way(self, why: str) -> None:
        self.health.trouble('topics.namesake', why, self._now())
        self._diagnoser.say_goodbye(self._now())
        self.finished.set_result(why)

    def _facts(self) -> dict[str, str]:
        stream = self.stream
        facts = {PROCESS: self._namesake.process,
                 'state': 'adapting' if stream.running else 'listening',
                 'joint': self.settings.joint, 'samples': str(stream.samples),
                 'samples left out': str(stream.lost), 'restarts': str(stream.restarts),
                 'messages out of order': str(stream.late)}
        if stream.period:
            facts['rate'] = f'{SECOND / stream.period:.6g} Hz'
        for topic, kind in self._topics.kinds.items():
            usual, name = stream.usual_period(topic), self.resolve_topic_name(topic)
            facts[name] = f'{kind}, ' + (f'{1.0 / usual:.4g} Hz' if usual else 'not yet heard')
            clock = stream.clocks[topic]
            if clock.offset:
                facts[f'clock of {name}'] = f'{-clock.offset * 1e-9:+.6f} s against ours'
            if clock.unset and clock.unset == clock.taken:
                facts[f'clock of {name}'] = 'no stamps: the instant of receipt counts'
        return facts


def mapping_of(name_or_path: str, joint: str) -> MappedColumns:
    """Return the mapping of a path or a shipped name. Raises MappingError."""
    try:
        path = at_home(name_or_path)
    except ValueError as error:
        raise MappingError(f'mapping = {error}') from None
    folder = Path(get_package_share_directory('servo_rig_driver')) / 'config' / 'imports'
    if name_or_path and not path.suffix and len(path.parts) == 1:
        path = folder / f'{name_or_path}.yaml'
    if not path.is_file():
        known = sorted(file.stem for file in folder.glob('*.yaml'))
        raise MappingError(f'mapping = {name_or_path!r}: there is no such file; give the path of '
                           f'one, or a shipped name: {known}')
    return read_mapping(path, joint)


def main(arguments: list[str] | None = None) -> int:
    """Run the adapter until told to stop; 1: another has its name, 2: it cannot start."""
    free_output()
    sys.setswitchinterval(5e-4)
    ending = Ending()
    start_ros(arguments)
    try:
        node = Adapter()
    except (*UNFIT, MappingError) as error:
        return cannot_start('adapter', error)
    executor = EventsExecutor()
    try:
        executor.add_node(node)
        ending.spin(executor, node.finished)
    finally:
        refused = node.finished.done()
        node.destroy_node()
        rclpy.try_shutdown()
    return int(refused)


if __name__ == '__main__':
    raise SystemExit(main())
