"""The watch over the twin's residuals: which balance changed, and where the change is."""

from __future__ import annotations

from copy import copy
from threading import Thread

import numpy as np
from rclpy.node import Node

from servo_twin.nodes.topic_qos import EVENTS
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import BALANCES
from servo_twin_msgs.msg import Event, Residual

from ..jobs.live.sample_ring import Ring
from ..watch.changes.alarm import Alarm
from ..watch.changes.change_detector import ChangeDetector, Settings
from ..watch.changes.change_place import AFTER, ChangePlace, Located
from ..watch.changes.excitation_level import driving, half_window
from .identify_parameters import value
from .message_conversion import OK, STALE, to_residuals, WARN

GATHERED = 0.1  # s of samples that are looked at at once


class ChangeWatch:
    """
    Watches for changes by the parameters ``watch.*`` of a node, and tells of them as its events.

    ``ring`` has the samples that the residuals are of.
    """

    def __init__(self, node: Node, ring: Ring) -> None:
        self._node, self._ring = node, ring
        self._detector: ChangeDetector | None = None
        self._place: ChangePlace | None = None
        self._located: Located | None = None
        self._to_locate: Alarm | None = None
        self._locating: Thread | None = None
        self._residuals: list[tuple[int, np.ndarray]] = []
        self._events = node.create_publisher(Event, 'events', EVENTS)

    def close(self) -> None:
        """Wait for what still looks for a place."""
        if self._locating is not None:
            self._locating.join()

    def begin_again(self) -> None:
        """Drop what may be half done, or is of another servo; the next residuals begin again."""
        self._detector, self._residuals = None, []

    def learn_again(self) -> bool:
        """Learn again what is usual; False where nothing is watched."""
        if self._detector is None or self._place is None:
            return False
        self._detector.relearn()
        self._place.relearn()
        self._located = self._to_locate = None
        return True

    def take(self, message: Residual, servo: Servo) -> bool:
        """Take residuals of the twin of ``servo``; return whether a balance has changed."""
        if not value(self._node, 'watch.on'):
            self._detector = None
            return False
        try:
            residuals = to_residuals(message)
        except ValueError as problem:
            self._node.get_logger().warning(str(problem), throttle_duration_sec=10.0)
            return False
        if self._detector is None or self._detector.period != message.period:
            settings = Settings(*(value(self._node, f'watch.{name}') for name in (
                'block', 'learn', 'false_alarms')))
            self._detector = ChangeDetector(BALANCES, message.period, settings)
            self._place = ChangePlace(servo, message.period, settings.block, settings.learn)
            self._located = self._to_locate = None
        assert self._place is not None
        self._residuals.append((message.sequence, residuals))
        if sum(len(r) for _, r in self._residuals) * message.period < GATHERED:
            return False
        waiting, self._residuals = self._residuals, []
        found: list[Alarm] = []
        half, wide = half_window(message.period), self._place.half
        for sequence, rows in _joined(waiting):
            around = self._ring.rows(sequence - half, len(rows) + 2 * half)
            found += self._detector.push(sequence, rows, driving(
                around, message.period, servo.values['mechanism.ratio']))
            self._place.push(sequence, self._ring.rows(sequence - wide, len(rows) + 2 * wide))
            self._find_place(found, sequence + len(rows), message)
        for alarm in found:
            self._node.get_logger().warning(f'balance {alarm.balance} changed')
            self._happened('change', alarm.balance, str(alarm), message)
        return bool(found)

    def health(self) -> tuple[int, str, dict[str, str]]:
        """Return level, sentence and facts for /diagnostics."""
        detector = self._detector
        if detector is None:
            return (STALE, 'no residuals came', {}) if value(self._node, 'watch.on') else (
                OK, 'switched off by watch.on', {})
        facts = {'state': detector.state, 'learned': f'{detector.learned:.2f}',
                 'blocks passed over': str(detector.passed_over),
                 'false alarms an hour, at most': f'{detector.settings.false_alarms:g}'}
        if not detector.alarms:
            said = ('no balance changed' if detector.state == 'watching' else
                    f'learning what is usual: {100.0 * detector.learned:.0f} %')
            return OK, said, facts
        alarms = sorted(detector.alarms.values(), key=lambda a: (a.sequence, -abs(a.deviations)))
        for alarm in alarms:
            facts[alarm.balance] = f'{alarm.seen}, seen at {alarm.sequence}'
        said = f'changed: {", ".join(alarm.balance for alarm in alarms)}'
        if self._located is not None:
            facts['place'] = str(self._located)
            said += f'; in: {" or ".join(self._located.places)}'
        return WARN, said, facts

    def _happened(self, kind: str, content: str, text: str, seen: Residual) -> None:
        """Tell what was found as an event, which the recorder keeps, by the residual then."""
        event = Event(source=self._node.get_fully_qualified_name(), kind=kind, content=content,
                      text=text)
        event.header.stamp = seen.header.stamp
        self._events.publish(event)

    def _find_place(self, found: list[Alarm], at: int, seen: Residual) -> None:
        """Have the place of the first change found, some time after its alarm."""
        if found and self._to_locate is None:
            self._to_locate = found[0]
        alarm = self._to_locate
        if (alarm is None or self._located is not None
                or at < alarm.sequence + AFTER / seen.period
                or (self._locating is not None and self._locating.is_alive())):
            return
        place = copy(self._place)

        def locate() -> None:
            found = place.locate(alarm.since)
            if found is not None and alarm is self._to_locate:
                self._located = found
                self._node.get_logger().warning(f'the change is in: {found}')
                self._happened('place', ' or '.join(found.places), f'the change is in: {found}',
                               seen)

        self._locating = Thread(target=locate, daemon=True)
        self._locating.start()


def _joined(pieces: list[tuple[int, np.ndarray]]) -> list[tuple[int, np.ndarray]]:
    """Join residuals that continue each other, as (sequence of the first, rows)."""
    runs: list[list] = []
    for sequence, rows in pieces:
        if runs and runs[-1][1] == sequence:
            runs[-1][1] += len(rows)
            runs[-1][2].append(rows)
        else:
            runs.append([sequence, sequence + len(rows), [rows]])
    return [(first, np.vstack(rows)) for first, _, rows in runs]
