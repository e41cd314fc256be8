"""
The identify node: learns, judges and watches beside a running rig and its twin.

It keeps the last minutes of the rig's samples; offers the actions `retrain` and `diagnose`, whose
work is done by processes of their own; publishes `twin/estimate`; and says on /diagnostics which
balance changed and which servo file the twin runs. A new servo file is on trial: where its
residuals are worse, the node goes back to the old one. Services: `identify/go_back` loads the
servo file before, `identify/relearn` has the change detector learn again.
"""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial
from pathlib import Path
import sys
import tempfile
from threading import Thread

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.nodes import message_conversion as twin_conversion
from servo_twin.nodes.free_output import free_output
from servo_twin.nodes.given_parameters import cannot_start, judge_remaps, refuse_unknown, UNFIT
from servo_twin.nodes.namesake import Namesake, PROCESS
from servo_twin.nodes.node_help import asked_for_help
from servo_twin.nodes.spinning import started
from servo_twin.nodes.timer_clock import STEADY
from servo_twin.nodes.topic_qos import EVENTS, OVERRIDABLE, sample_qos
from servo_twin.recording.events import SERVO_FILE
from servo_twin.recording.sample_joining import Joiner
from servo_twin_msgs.msg import Estimate, Event, Residual

from ..jobs.live.sample_ring import Ring
from ..jobs.live.servo_versions import Models
from ..watch.estimator.online_estimator import OnlineEstimator
from . import identify_parameters
from . import message_conversion as conversion
from .change_watch import ChangeWatch, GATHERED
from .followed_twin import FollowedTwin
from .identify_parameters import value
from .jobs_node import ACTIONS, Jobs
from .message_conversion import OK, WARN
from .short_memory import SAID, Shortage
from .twin_servo import SERVICES

REPORT_EVERY = 1.0  # s
TOPICS = {**twin_conversion.TOPICS, 'twin/residual': Residual, 'twin/estimate': Estimate,
          'events': Event}


class IdentifyNode(Node):
    """
    Samples, residuals and reports.

    Raises ValueError for a servo file or a folder that cannot be, or a wrong name.
    """

    def __init__(self, scratch: Path, shortage: Shortage) -> None:
        super().__init__('identify')
        self.shortage = shortage
        self.finished: Future = Future()  # another node of this name began before it
        identify_parameters.declare(self)
        refuse_unknown(self)
        judge_remaps(self, TOPICS, {'identify/relearn': Trigger, **SERVICES}, ACTIONS)
        text = servo_at(value(self, 'servo_file')).read_text()
        self.models = Models(text, value(self, 'margin'))
        self.ring = Ring(value(self, 'buffer'))
        self._watch = ChangeWatch(self, self.ring)
        self._servo = servo_file.loads(text, 'servo_file')
        self._estimator: OnlineEstimator | None = None
        self._stale = False
        self._pushed = 0
        self._judging: Thread | None = None
        self._joiner: Joiner = Joiner(tuple(twin_conversion.TOPICS))
        self.jobs = Jobs(self, self.ring, self.models, identify_parameters.folder(self, scratch),
                         shortage)
        guarded = shortage.guarded
        for topic, kind in twin_conversion.TOPICS.items():
            self.create_subscription(
                kind, topic, guarded(partial(self._take, topic), self._estimate_again),
                sample_qos(), qos_overriding_options=OVERRIDABLE)
        self.create_subscription(Residual, 'twin/residual',
                                 guarded(self._compare, self._watch.begin_again), sample_qos(),
                                 qos_overriding_options=OVERRIDABLE)
        self._namesake = Namesake(self, self.finished.set_result)
        self._twin = FollowedTwin(self, value(self, 'twin'))
        self.create_subscription(Event, 'events', guarded(self._follow), EVENTS)
        self._estimate = self.create_publisher(Estimate, 'twin/estimate', 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_service(Trigger, 'identify/relearn', guarded(self._relearn))
        self.create_timer(REPORT_EVERY, guarded(self._report), clock=STEADY)
        self.create_timer(value(self, 'online.period'), guarded(self._tell), clock=STEADY)

    def close(self) -> None:
        """End jobs and their threads."""
        self.jobs.close()
        self._watch.close()
        if self._judging is not None:
            self._judging.join()

    def _estimate_again(self) -> None:
        """Drop an estimator that a shortage of memory may have left half done."""
        self._estimator = None

    # Samples.

    def _take(self, topic: str, message) -> None:
        parts = self._joiner.put(topic, message.sequence, message)
        if parts is None:
            return
        first = parts['encoder']
        try:
            samples = twin_conversion.to_samples(parts)
        except ValueError as problem:
            self.get_logger().warning(str(problem), throttle_duration_sec=10.0)
            return
        self.ring.put(first.sequence, twin_conversion.to_instant(first.header.stamp),
                      first.period, samples)
        if self.ring.next - self._pushed >= GATHERED / first.period or (
                self.ring.next < self._pushed):
            self._push(first.period)

    def _push(self, period: float) -> None:
        """Give the estimator what came since the last time."""
        start = self._pushed if 0 < self.ring.next - self._pushed <= len(self.ring) else (
            self.ring.next - min(len(self.ring), round(GATHERED / period)))
        self._pushed = self.ring.next
        if not value(self, 'online.on'):
            self._estimator = None
            return
        if self._estimator is None or self._stale or self._estimator.period != period:
            self._stale = False
            self._servo = servo_file.loads(self.models.running, 'the servo file that runs')
            self._estimator = OnlineEstimator(self._servo, period)
        self._estimator.time_constant = value(self, 'online.time_constant')
        self._estimator.push(start, self.ring.rows(start, self._pushed - start))

    # The twin's residuals.

    def _compare(self, message: Residual) -> None:
        if self._watch.take(message, self._servo):
            self._report()

    def _relearn(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self._watch.learn_again()
        response.message = ('learning again' if response.success
                            else 'nothing is watched: no residuals came, or watch.on is false')
        return response

    # The servo file of the twin.

    def _follow(self, message: Event) -> None:
        """Take over what the twin says that it runs, whoever has loaded or set it."""
        if not self._twin.says(message.source, message.kind):
            return
        try:
            others = self.models.follows(message.kind, message.content)
        except ValueError as problem:
            self.get_logger().warning(f'what the twin runs is not known: {problem}')
            return
        if others:
            self.get_logger().info(self.models.sentence)
        if others or message.kind == SERVO_FILE:
            self._servo = servo_file.loads(self.models.running, 'the servo file that runs')
            self._stale = True
            self._watch.begin_again()

    def _judge(self) -> None:
        """Have the file on trial judged once it has run long enough."""
        trial, seconds = self.models.trial, value(self, 'trial')
        self.models.margin = value(self, 'margin')
        if trial is None or (self._judging is not None and self._judging.is_alive()):
            return
        if self.ring.since(trial.since) >= min(seconds, self.ring.seconds - 1.0):
            self._judging = Thread(target=self.jobs.judge, args=(seconds,), daemon=True)
            self._judging.start()

    # Reports.

    def _tell(self) -> None:
        if self._estimator is None or not self._estimator.names:
            return
        known = self._estimator.snapshot()
        if not known.rows.any():
            return
        stamp = self.get_clock().now().nanoseconds
        picked = known.rows > 0
        self._estimate.publish(conversion.to_estimate(
            [n for n, p in zip(known.names, picked, strict=True) if p], known.values[picked],
            known.std[picked], known.bounded[picked], max(0, known.sequence), stamp,
            self.get_namespace().strip('/')))

    def _report(self) -> None:
        self._judge()
        name, missed = self.get_fully_qualified_name(), self._twin.missed()
        statuses = [conversion.to_status(name, 'changes', *self._watch.health()),
                    conversion.to_status(name, 'models', WARN if missed else OK,
                                         missed or self.models.sentence, {
                        PROCESS: self._namesake.process,
                        'loads': str(self.models.loads), 'returns': str(self.models.returns),
                        'on trial': 'yes' if self.models.trial else 'no',
                        'samples kept': str(len(self.ring))}),
                    conversion.to_status(
                        name, 'memory', *((WARN, f'{SAID}; estimator or detector began again')
                                          if self.shortage.now else (OK, 'there is enough')),
                        {'times short': str(self.shortage.times)})]
        self._diagnostics.publish(conversion.to_diagnostics(
            statuses, self.get_clock().now().nanoseconds))


def main(arguments: list[str] | None = None) -> int:
    """Run the identify node until told to stop; 1: no memory, or namesake, 2: a bad parameter."""
    if asked_for_help('identify_node', __doc__, 'config/identify.yaml'):
        return 0
    free_output()
    ending, shortage = started(arguments), Shortage()
    with ExitStack() as kept:
        try:
            scratch = kept.enter_context(tempfile.TemporaryDirectory(prefix='servo_identify_'))
            node = IdentifyNode(Path(scratch), shortage)
        except (*UNFIT, ValueError, OSError) as problem:
            return cannot_start('identify_node', problem)
        executor = EventsExecutor()
        executor.add_node(node)
        try:
            return shortage.spin(ending, executor, node.finished)
        finally:
            node.close()
            executor.remove_node(node)
            node.destroy_node()
            rclpy.try_shutdown()


if __name__ == '__main__':
    sys.exit(main())
