"""Between the topics of a rig and its lockstep: messages in, predictions and residuals out."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import monotonic
from typing import Any

from rclpy.lifecycle import LifecycleNode

from servo_twin_msgs.msg import Event, PlotResidual, Prediction, Residual
from servo_twin_msgs.srv import LoadServo

from ..lockstep.lockstep import Answer, Lockstep
from ..physics.servo import ServoError
from ..recording.sample_joining import Joiner
from ..recording.waiting_blocks import Block, WaitingBlocks
from . import message_conversion as conversion
from .given_parameters import judge_remaps
from .mixed_topics import mixed
from .plot_residuals import PlotResiduals, TOPIC
from .topic_qos import OVERRIDABLE, sample_qos
from .twin_health import TwinHealth

ANSWERS = {'twin/prediction': Prediction, 'twin/residual': Residual}
AGAIN = 1.0
"""s between two drivers at least: what goes back more often is of two that publish at once."""


def judge_names(node: LifecycleNode) -> None:
    """Raise SharedName where remaps give two of the twin's topics or services one name."""
    judge_remaps(node, {**conversion.TOPICS, **ANSWERS, TOPIC: PlotResidual, 'events': Event},
                 {'twin/load_servo': LoadServo})


class LiveAnswers:
    """
    The topics of a twin node between configure and cleanup, and what becomes of their samples.

    ``begin(period)`` makes a lockstep for samples that come every ``period`` s; ServoError where
    it cannot. ``again(period)`` is called where their numbers begin again, as those of another
    driver do. ``lockstep`` is the one that runs, None before the first sample; ``next`` is the
    number of the sample that a change acts on first; ``zero`` is the instant of number 0, ns.
    """

    def __init__(self, node: LifecycleNode, begin: Callable[[float], Lockstep],
                 again: Callable[[float], None] = lambda period: None) -> None:
        self._node, self._begin, self._again = node, begin, again
        self.lockstep: Lockstep | None = None
        self.next = self.zero = 0
        self._told_again = -AGAIN
        self.active = False
        self.health = TwinHealth()
        self._joiner: Joiner = Joiner(tuple(conversion.TOPICS))
        self._waiting = WaitingBlocks()
        self._coming = False
        self._prediction = conversion.Outgoing(Prediction)
        self._residual = conversion.Outgoing(Residual)
        self._plots: PlotResiduals | None = None
        self._outputs: list = []
        self._inputs: list = []

    def open(self) -> None:
        """Make the topics; what comes is passed over until :meth:`activate`."""
        for topic, kind in ANSWERS.items():
            self._outputs.append(self._node.create_lifecycle_publisher(
                kind, topic, sample_qos(), qos_overriding_options=OVERRIDABLE))
        self._plots = PlotResiduals(self._node)
        self._outputs.append(self._plots.publisher)
        for topic, kind in conversion.TOPICS.items():
            self._inputs.append(self._node.create_subscription(
                kind, topic, partial(self._take, topic), sample_qos(),
                qos_overriding_options=OVERRIDABLE))

    def activate(self) -> None:
        """Step from the next sample on."""
        self._joiner = Joiner(tuple(conversion.TOPICS))
        self._waiting = WaitingBlocks()
        self.health = TwinHealth()
        self.active = True

    def deactivate(self) -> None:
        """Answer what waits, publish the residuals still owed, and let the samples pass by."""
        self._step_all()
        self._finish()
        self.active = False

    def close(self) -> None:
        """Give the topics up, whatever is owed."""
        self.active, self.lockstep = False, None
        for topic in self._outputs:
            self._node.destroy_lifecycle_publisher(topic)
        for topic in self._inputs:
            self._node.destroy_subscription(topic)
        self._outputs, self._inputs = [], []

    def report(self) -> tuple[int, str, dict[str, str]]:
        """Return (level, sentence, facts) of the health since the last report."""
        return self.health.report(self.lockstep, self._joiner.given_up, self._joiner.silent(),
                                  self._waiting, mixed(self._node, (*conversion.TOPICS, *ANSWERS)))

    @property
    def readers(self) -> dict[str, str]:
        """How many readers each topic of answers has, as facts."""
        return {f'readers of twin/{output.topic_name.rpartition("/")[2]}':
                str(output.get_subscription_count()) for output in self._outputs}

    def _take(self, topic: str, message: Any) -> None:
        if not self.active:
            return
        parts = self._joiner.put(topic, message.sequence, message)
        if parts is None:
            return
        first = parts['encoder']
        self._prediction.frame = self._residual.frame = first.header.frame_id
        try:
            samples = conversion.to_samples(parts)
        except ValueError as problem:
            self._malformed(problem)
            return
        self._waiting.put(Block(message.sequence, conversion.to_instant(first.header.stamp),
                                first.period, samples))
        if not self._coming:  # behind all messages that have come: they are seen to wait
            self._coming = True
            self._node.executor.create_task(self._step_all)

    def _malformed(self, problem: ValueError) -> None:
        self.health.malformed += 1
        self.health.why = str(problem)

    def _step_all(self) -> None:
        """Answer what waits."""
        self._coming = False
        for block in self._waiting.take(self._node.get_parameter('overload').value):
            if not self.active:
                return
            try:
                self._step(block)
            except ServoError as problem:
                self._malformed(problem)
            except Exception as problem:  # rclpy's executor ends the process with such a task
                self._malformed(ValueError(f'{type(problem).__name__}: {problem}'))

    def _step(self, block: Block) -> None:
        back, self.next = block.sequence < self.next, block.sequence
        lockstep = self._in_pace(block, back)
        samples = block.samples
        self.next = block.sequence + len(samples)
        prediction, due = lockstep.step(block.sequence, block.stamp, samples)
        now = self._node.get_clock().now().nanoseconds
        twin = lockstep.twin
        self._outputs[0].publish(self._prediction.filled(
            prediction, twin.period, restarts=twin.restarts))
        self.health.predicted(samples, _age(prediction, twin.period, now))
        for residual in due:
            self._compare(lockstep, residual, now)

    def _in_pace(self, block: Block, back: bool) -> Lockstep:
        """
        Return a lockstep at the rig's period. Raises ServoError for one that cannot be.

        ``back``: whether the numbers of the samples have begun again.
        """
        lockstep, period = self.lockstep, block.period
        if lockstep is None or abs(lockstep.twin.period - period) > 1e-9 * period:
            if not period > 0.0:
                raise ServoError(f'encoder.period = {period} s, it must be positive')
            self._finish()
            self.zero = _zero(block)
            lockstep = self.lockstep = self._begin(period)
        elif back and monotonic() - self._told_again >= AGAIN:
            self._told_again, self.zero = monotonic(), _zero(block)
            self._again(period)
        return lockstep

    def _compare(self, lockstep: Lockstep, residual: Answer, now: int) -> None:
        period = lockstep.twin.period
        self._outputs[1].publish(self._residual.filled(
            residual, period, channel_noise=lockstep.balances.channel_noise,
            balance_noise=lockstep.balances.noise))
        self._plots.take(residual, period, self._node.get_parameter('plot_rate').value,
                         self._residual.frame)
        self.health.compared(residual.values, _age(residual, period, now))

    def _finish(self) -> None:
        """Publish what is owed and end the lockstep."""
        if self.lockstep is not None:
            now = self._node.get_clock().now().nanoseconds
            for residual in self.lockstep.finish():
                self._compare(self.lockstep, residual, now)
            self.lockstep = None


def _zero(block: Block) -> int:
    return block.stamp - round(block.sequence * block.period * 1e9)


def _age(answer: Answer, period: float, now: int) -> float:
    """Return how long before ``now``, ns, the last sample of an answer was taken, s."""
    return (now - answer.stamp) * 1e-9 - (len(answer.values) - 1) * period
