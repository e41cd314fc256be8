"""A running rig and its twin as a source of the view: topics in, parameters out."""

from __future__ import annotations

import asyncio
from collections import deque
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
import os
from threading import Thread
from time import monotonic
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future as RosFuture

from servo_twin_msgs.msg import Event, Prediction, Residual

from ..description.servo_file import dumps, load, loads
from ..description.shipped import servo_file
from ..lockstep.live_changes import changed
from ..nodes.ending import LOOKS
from ..nodes.heard_health import HeardHealth
from ..nodes.message_conversion import check, to_instant, TOPICS
from ..nodes.timer_clock import STEADY
from ..physics.servo import Servo, ServoError
from ..recording.events import BEGAN, Happened, SERVO_FILE
from ..recording.joined_samples import CHANNELS
from ..recording.recording import BALANCES, COMPARED, PREDICTED, Recording
from .source import EVENTS, Refused, Source
from .twin_values import TwinValues

SAMPLES = QoSProfile(depth=500)
_KEPT = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_LOOKS = 1.0  # s between two looks at whether a twin is there
_SILENT = 1.5  # s without a sample after which the page says so
_SHORTEST = 5.0  # s of samples from which a diagnosis makes sense
_ANSWERS = 5.0  # s that a twin may take for a parameter
_FIELDS = {
    **{topic: {name: name for name in kind.get_fields_and_field_types() if name in CHANNELS}
       for topic, kind in TOPICS.items()},
    'twin/prediction': {name: f'twin.{name}' for name in PREDICTED},
    'twin/residual': {**{name: f'gap.{name}' for name in COMPARED},
                      **{name: f'balance.{name}' for name in BALANCES}},
}
"""Topic: its fields, and what the view calls them."""


class LiveRig(Source):
    """
    The rig of a namespace, heard by a node of its own on a thread.

    Samples are subscribed to while somebody looks only; health and events always. ROS has been
    started before, without its signal handlers.
    """

    kind = 'rig'

    def __init__(self, namespace: str) -> None:
        super().__init__()
        self.namespace = '/' + namespace.strip('/')
        self._node = Node(f'view_{os.getpid()}', namespace=self.namespace)
        self._health = HeardHealth(namespace)
        self._events: deque[Happened] = deque(maxlen=EVENTS)
        self._values = TwinValues(self._node, f'{self.namespace}/twin')
        self._inputs: list = []
        self._heard = 0.0
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._health.hear, 100)
        self._node.create_subscription(Event, 'events', self._happened, _KEPT)
        self._executor = EventsExecutor()
        self._executor.add_node(self._node)
        self._node.create_timer(_LOOKS, self._values.look, clock=STEADY)
        self._known: tuple[tuple, Servo | None] = ((), None)
        self._over = RosFuture()  # heeded by an executor that always has work to do, too
        self._thread = Thread(target=self._spin, name='ros', daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while rclpy.ok() and not self._over.done():
            self._executor.spin_until_future_complete(self._over, LOOKS)

    def look(self, wanted: bool) -> None:
        """Subscribe to the samples, or let them pass by."""
        self._executor.create_task(self._subscribe if wanted else self._unsubscribe)

    def _subscribe(self) -> None:
        if self._inputs:
            return
        for topic, kind in {**TOPICS, 'twin/prediction': Prediction,
                            'twin/residual': Residual}.items():
            self._inputs.append(self._node.create_subscription(
                kind, topic, partial(self._take, topic, _FIELDS[topic]), SAMPLES))

    def _unsubscribe(self) -> None:
        for one in self._inputs:
            self._node.destroy_subscription(one)
        self._inputs = []
        self.traces.clear()  # what follows would not join it

    def _take(self, topic: str, fields: dict[str, str], message: Any) -> None:
        try:
            check(message)
        except ValueError:  # the twin says it
            return
        self._heard = monotonic()
        self.traces.put(topic, message.sequence, to_instant(message.header.stamp), message.period,
                        {ours: np.frombuffer(getattr(message, theirs))
                         for theirs, ours in fields.items()})

    def _happened(self, message: Event) -> None:
        self._events.append(Happened(to_instant(message.header.stamp), message.source,
                                     message.kind, message.text, message.sequence,
                                     message.content))

    def advance(self) -> None:
        """Nothing is due: samples come by themselves."""

    def facts(self) -> dict[str, Any]:
        """Return what nodes say of themselves, and the values of the twin."""
        health = self._health
        nodes = [{'name': name, 'level': health.levels[name], 'said': health.sentences[name]}
                 for name in sorted(health.levels)]
        twin = health.facts.get('twin', {})
        silent = monotonic() - self._heard > _SILENT
        said = f'no samples on {self.namespace}: is the driver active?' if silent else 'live'
        return {'status': {'title': self.namespace, 'servo': twin.get('servo', ''), 'said': said,
                           'level': 2 if silent else 0, 'nodes': nodes, 'warnings': []},
                'values': self._values.listed()}

    def servo(self) -> Servo | None:
        """Return the servo of the twin, as it was when it was configured or loaded."""
        key = (self._values.servo_file, self._health.facts.get('twin', {}).get('servo'),
               sum(one.kind in (BEGAN, SERVO_FILE) for one in list(self._events)))
        if key != self._known[0] and self._values.servo_file:
            try:
                self._known = key, self._running()
            except (ValueError, OSError):  # no twin runs, or it has another file by now
                return None
        return self._known[1]

    def events(self) -> list[Happened]:
        """Return what happened since the view was started, and what nodes keep from before."""
        return list(self._events)

    async def set_value(self, path: str, value: float) -> None:
        """Set a parameter of the twin; raises Refused with the twin's own words."""
        answered: Future = Future()
        self._executor.create_task(lambda: self._values.set(path, value, answered))
        try:
            async with asyncio.timeout(_ANSWERS):
                refused = await asyncio.wrap_future(answered)
        except TimeoutError:
            raise Refused(f'{path}: the twin did not answer within {_ANSWERS:g} s') from None
        if refused:
            raise Refused(refused)

    def recording(self, seconds: float) -> Recording:
        """Return the last seconds that somebody has looked at, with the servo as it runs."""
        traces = self.traces
        if not traces.period or traces.size * traces.period < _SHORTEST:
            raise ServoError(f'{traces.size * traces.period:.1f} s of samples are here since the '
                             f'page was opened; a diagnosis takes at least {_SHORTEST:g} s')
        servo = self._running()
        end = traces.end
        first = max(end - round(seconds / traces.period), end - traces.size)
        rows = traces.read(CHANNELS, first, end)
        return Recording(
            name='last_minute', period=traces.period,
            columns=dict(zip(CHANNELS, rows, strict=True)),
            start=traces.stamp * 1e-9 + first * traces.period, sequence=first, family='running',
            servo=servo.name, servo_file=dumps(servo), note='the last seconds of the running rig')

    def _running(self) -> Servo:
        """Return the servo that the twin runs, as its file and parameters say."""
        now = {one['path']: one['value'] for one in self._values.listed()}
        if not now:
            raise ServoError(f'no twin runs at {self.namespace}/twin: nothing says which servo '
                             'this is')
        name = self._health.facts.get('twin', {}).get('servo')
        for one in reversed(list(self._events)):
            with suppress(ServoError):  # another servo, or one that would bring code of its own
                return _running_as(loads(one.servo_file, one.text, code=False), name, now)
        return _running_as(load(servo_file(self._values.servo_file)), name, now)

    def close(self) -> None:
        """End thread and node."""
        self._over.set_result(None)
        self._thread.join()
        self._executor.remove_node(self._node)
        self._node.destroy_node()
        rclpy.try_shutdown()


def _running_as(servo: Servo, name: str | None, now: dict[str, Any]) -> Servo:
    """Return a servo with the values of the one that runs. Raises ServoError if it is another."""
    own = {path for path, value in servo.values.items() if not isinstance(value, tuple)}
    if own != now.keys() or name not in (None, servo.name):
        raise ServoError(f'the file of {servo.name} is by now not what the twin runs: clean the '
                         'twin up and configure it again, so that both are one')
    return changed(servo, now)
