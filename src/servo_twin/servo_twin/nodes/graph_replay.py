"""Plays the samples of a bag into ROS at a chosen rate, with /clock, as its rig did."""

from __future__ import annotations

from array import array
from pathlib import Path
import time

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from ..bag import namespaces, open_recording
from ..recording.parts import LongRecording, parts_of
from ..recording.recording import Recording
from .ending import Ending
from .message_conversion import SECOND, to_time, TOPICS
from .spinning import started

BLOCK = 0.01  # s of samples in one message, at least one sample
_MATCH = 10.0  # s that the first sample waits for somebody to listen
_JOINING = 3.5  # s after which all have joined: one who missed the first news of it waits 3 s


class GraphReplay(Node):
    """
    Publishes `encoder`, `torque` and `current` of a recording, and the clock of its time.

    Blocks leave at absolute deadlines of the wall clock, each when its last sample was taken.
    """

    def __init__(self, recording: LongRecording, rate: float, namespace: str,
                 ending: Ending | None = None) -> None:
        super().__init__('replay', namespace=namespace)
        self._recording, self._rate, self._ending = recording, rate, ending
        self._sent = 0
        reliable = QoSProfile(depth=max(1000, round(2.0 / recording.period)),
                              reliability=ReliabilityPolicy.RELIABLE)
        self._topics = {name: (kind, self.create_publisher(kind, name, reliable))
                        for name, kind in TOPICS.items()}
        self._clock = self.create_publisher(Clock, '/clock', 100)

    def play(self) -> int:
        """Publish all samples and return how many; stops early when the process is to end."""
        recording = self._recording
        self._wait_for_listeners()
        begin = time.monotonic()
        for part in parts_of(recording):
            if not self._play(part, begin):
                break
        for _, publisher in self._topics.values():
            publisher.wait_for_all_acked(rclpy.duration.Duration(seconds=2.0))
        return self._sent

    def _play(self, part: Recording, begin: float) -> bool:
        """Publish a part of what began at ``begin``; return whether to go on."""
        first = part.sequence - self._recording.sequence
        start = round(self._recording.start * SECOND)
        size = max(1, round(BLOCK / part.period))
        for at in range(0, len(part), size):
            end = min(len(part), at + size)
            instant = start + round((first + at) * part.period * SECOND)
            rest = begin + (first + end) * part.period / self._rate - time.monotonic()
            if rest > 0.0:
                time.sleep(rest)
            if self._over():
                return False
            self._clock.publish(Clock(clock=to_time(
                start + round((first + end) * part.period * SECOND))))
            for kind, publisher in self._topics.values():
                message = kind()
                message.header.stamp = to_time(instant)
                message.sequence = part.sequence + at
                message.period = part.period
                for field in kind.get_fields_and_field_types():
                    if field in part.columns:
                        values = np.ascontiguousarray(part[field][at:end])
                        setattr(message, field, array('d', values.tobytes()))
                publisher.publish(message)
            self._sent = first + end
        return True

    def _over(self) -> bool:
        return not rclpy.ok() or (self._ending is not None and self._ending.asked)

    def _wait_for_listeners(self) -> None:
        """Wait until each topic is heard and nobody has joined for _JOINING."""
        until = time.monotonic() + _MATCH
        before, since = [0], until
        while (now := time.monotonic()) < until and not self._over():
            heard = [publisher.get_subscription_count() for _, publisher in self._topics.values()]
            if heard != before:
                before, since = heard, now
            elif all(heard) and now - since >= _JOINING:
                return
            time.sleep(0.02)


def play(bag: Path, rate: float, namespace: str | None, stretch: int | None) -> int:
    """Play a bag into the graph and return the exit status; raises ValueError for a bad rate."""
    if not 0.0 < rate <= 1000.0:
        raise ValueError(f'--rate {rate:g} is outside (0, 1000]')
    where = namespace if namespace is not None else namespaces(bag)[0]
    with open_recording(bag, namespace, stretch) as recording:
        node = GraphReplay(recording, rate, where, started())
        try:
            sent = node.play()
            print(f'{recording.name}: {sent} of {len(recording)} samples published at {rate:g} '
                  'times real time')
        finally:
            node.destroy_node()
            rclpy.try_shutdown()
        return 0 if sent == len(recording) else 1
