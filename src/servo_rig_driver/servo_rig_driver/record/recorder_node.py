"""
Recorder node: writes the topics of a rig and its twin to a bag until it is told to stop.

What somebody publishes on `note` becomes an event of the recording, at its instant:

    ros2 topic pub --once /rig/note std_msgs/msg/String "data: oil changed"

Messages are taken as the bytes that travelled and written unseen. What is on disk survives a
killed process up to the last whole chunk, half a second by default.
"""

from __future__ import annotations

from datetime import datetime
from importlib import import_module
import os
from pathlib import Path
import sys
from time import monotonic, time_ns

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.serialization import serialize_message
from rclpy.task import Future
from std_msgs.msg import String

from servo_twin_msgs.msg import Event, RecordingInfo

from ..ending import Ending
from ..free_output import free_output
from ..given_parameters import cannot_start, refuse_unknown, UNFIT
from ..home_path import at_home
from ..namesake import Namesake, PROCESS
from ..node_help import asked_for_help
from ..ros_start import start_ros
from ..timer_clock import STEADY
from .growing_bag import NO_ROOM, RecordingFile
from .last_messages import take_what_has_come
from .mixed_topics import mixed
from .recorder_parameters import declare, EVENT, of_one_node, topics_of
from .sequence_loss import block_of, SEQUENCED, SequenceWatch
from .servo_name import servo_name, servo_text

INFO = 'recording'
OVERRIDABLE = QoSOverridingOptions.with_default_policies()
_WITHOUT = 2.0  # s without a sample after which a recorder records nothing that counts
_TELLS = 10.0  # s for which a loss is a warning
_REPORT = 1.0  # s from one report on /diagnostics to the next


class Recorder(Node):
    """
    Records until ``done`` is set.

    Raises ValueError for a topic without a type, a servo file that is not there or a parameter
    that it does not have, and FileExistsError for an output that exists.
    """

    def __init__(self) -> None:
        super().__init__('recorder')
        self.done: Future = Future()
        self.failure = ''
        declare(self)
        refuse_unknown(self)
        topics = topics_of(self)
        output = self._get('output') or datetime.now().strftime('recordings/%Y-%m-%d_%H-%M-%S')
        info = self._info()
        info_topic = self.resolve_topic_name(INFO)
        self.file = RecordingFile(
            at_home(output),
            {info_topic: 'servo_twin_msgs/msg/RecordingInfo'} | topics, _shares(),
            frozenset([info_topic]), self._get('chunk_bytes'), self._get('chunk_seconds'))
        self.watches = {topic: SequenceWatch() for topic, kind in topics.items()
                        if kind in SEQUENCED}
        self._of_one = of_one_node(topics)
        self.file.write(info_topic, time_ns(), serialize_message(info))
        self.file.flush(now=True)
        depth = self._get('history')
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._info_publisher = self.create_publisher(RecordingInfo, INFO, latched)
        self._info_publisher.publish(info)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._events = self.create_publisher(Event, 'events', _qos(EVENT, 100))
        self.create_subscription(String, 'note', self._note, _qos('', 100))
        for topic, kind in topics.items():
            self.create_subscription(_message_class(kind), topic, self._taker(topic),
                                     _qos(kind, depth), raw=True,
                                     qos_overriding_options=OVERRIDABLE)
        self.create_timer(min(0.1, self._get('chunk_seconds')), self._flush, clock=STEADY)
        self.create_timer(_REPORT, self._report, clock=STEADY)
        self._namesake = Namesake(self, self.stop)
        self._began = monotonic()
        self._lost, self._samples = (0, monotonic()), (0, monotonic())

    def _get(self, name: str):
        return self.get_parameter(name).value

    def _info(self) -> RecordingInfo:
        path, content = servo_text(self._get('servo_file'))
        info = RecordingInfo(
            servo=servo_name(path, content), servo_file=content, family=self._get('family'),
            replicate=self._get('replicate'), note=self._get('note'))
        info.header.stamp = self.get_clock().now().to_msg()
        return info

    def _taker(self, topic: str):
        watch = self.watches.get(topic)

        def take(data: bytes) -> None:
            if self.failure:
                return
            try:
                self.file.write(topic, time_ns(), data)
            except NO_ROOM as error:
                self._fail(error)
                return
            if watch is not None:
                watch.take(*block_of(data))

        return take

    def _note(self, message: String) -> None:
        """Make an event of what a user says, which is recorded as the others are."""
        event = Event(source=self.get_fully_qualified_name(), kind='note', text=message.data)
        event.header.stamp = self.get_clock().now().to_msg()
        self._events.publish(event)

    def _flush(self) -> None:
        if not self.failure:
            try:
                self.file.flush()
            except NO_ROOM as error:
                self._fail(error)

    def _fail(self, error: Exception) -> None:
        self.failure = (f'recording to {self.file.path} stopped: {error}; what came in the last '
                        f'{self.file.pending:.1f} s is not in it')
        self.stop()

    def close(self) -> None:
        """Close the bag; after a failure what is on disk stays as it is."""
        try:
            if not self.failure:
                self.file.close()
        except NO_ROOM as error:
            self._fail(error)
        if self.failure:
            self.file.abort()

    def stop(self, why: str = '') -> None:
        """End the recording as soon as the executor runs; ``why``: another has its name."""
        if not self.done.done():
            self.done.set_result(why)

    def _report(self) -> None:
        now = monotonic()
        lost = sum(watch.lost for watch in self.watches.values())
        samples = sum(watch.samples for watch in self.watches.values())
        if lost != self._lost[0]:
            self._lost = lost, now
        if samples != self._samples[0]:
            self._samples = samples, now
        said = f'recording; {lost} samples lost' if lost else 'recording'
        level = DiagnosticStatus.OK
        if self.watches and now - self._samples[1] > _WITHOUT:
            since = f'for {now - self._samples[1]:.0f} s' if samples else 'since it began'
            level, said = DiagnosticStatus.WARN, f'no sample came {since}; {said}'
        elif lost and now - self._lost[1] < _TELLS:
            level = DiagnosticStatus.WARN
        if several := mixed(self, self._of_one):
            level, said = DiagnosticStatus.WARN, f'{several}; {said}'
        values = {PROCESS: self._namesake.process, 'output': str(self.file.path),
                  'seconds': f'{monotonic() - self._began:.1f}'}
        values |= {f'messages {topic}': str(n) for topic, n in self.file.counts.items() if n}
        for topic, watch in self.watches.items():
            if watch.lost or watch.restarts:
                values[f'lost {topic}'] = f'{watch.lost} samples in {watch.gaps} gaps'
                values[f'restarts {topic}'] = str(watch.restarts)
        status = DiagnosticStatus(
            level=level, name=f'{self.get_fully_qualified_name()}: recording',
            hardware_id=self._get('servo_file'), message=said,
            values=[KeyValue(key=key, value=value) for key, value in values.items()])
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def summary(self) -> str:
        """Return what was recorded, one line a topic."""
        lines = [f'recorded {self.file.path}: {monotonic() - self._began:.1f} s']
        for topic, count in self.file.counts.items():
            watch = self.watches.get(topic)
            lines.append(f'  {topic}: {count} messages{f", {watch}" if watch is not None else ""}')
        return '\n'.join(lines)


def _qos(kind: str, depth: int) -> QoSProfile:
    """Return the QoS of a topic: what changed before the recording is needed to replay it."""
    kept = kind == EVENT
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if kept else DurabilityPolicy.VOLATILE)


def _message_class(kind: str) -> type:
    package, group, name = kind.split('/')
    try:
        return getattr(import_module(f'{package}.{group}'), name)
    except (ImportError, AttributeError) as error:
        raise ValueError(f'topics: type {kind} is not installed: {error}') from None


def _shares() -> list[Path]:
    return [Path(one) / 'share' for one in os.getenv('AMENT_PREFIX_PATH', '').split(':') if one]


def main() -> int:
    """Run the recorder until a signal or the end of its parent."""
    if asked_for_help('recorder', __doc__, 'config/recorder.yaml'):
        return 0
    free_output()
    ending = Ending()
    start_ros()
    try:
        node = Recorder()
    except (*UNFIT, ValueError, OSError) as error:
        return cannot_start('recorder', error)
    executor = EventsExecutor()
    executor.add_node(node)
    print(f'recording to {node.file.path}', flush=True)
    try:
        ending.spin(executor, node.done)
        take_what_has_come(executor, node.done)
    finally:
        node.close()
        print(node.summary(), flush=True)
        executor.remove_node(node)
        node.destroy_node()
        rclpy.try_shutdown()
    ended = node.failure or (node.done.result() if node.done.done() else '')
    if ended:
        print(f'recorder: {ended}', file=sys.stderr)
    return 1 if ended else 0


if __name__ == '__main__':
    sys.exit(main())
