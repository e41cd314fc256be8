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

from ..bag import namespaces, read_recording
from ..recording.recording import Recording
from .ending import Ending
from .message_conversion import SECOND, to_time, TOPICS
from .spinning import started

BLOCK = 0.01  # s of samples in one message, at least one sample
_MATCH = 5.0  # s that the first sample waits for somebody to listen


class GraphReplay(Node):
    """
    Publishes `encoder`, `torque` and `current` of a recording, and the clock of its time.

    Blocks leave at absolute deadlines of the wall clock, each when its last sample was taken.
    """

    def __init__(self, recording: Recording, rate: float, namespace: str, ending: Ending
                 ) -> None:
        super().__init__('replay', namespace=namespace)
        self._recording, self._rate, self._ending = recording, rate, ending
        reliable = QoSProfile(depth=max(1000, round(2.0 / recording.period)),
                              reliability=ReliabilityPolicy.RELIABLE)
        self._topics = {name: (kind, self.create_publisher(kind, name, reliable))
                        for name, kind in TOPICS.items()}
        self._clock = self.create_publisher(Clock, '/clock', 100)

    def play(self) -> int:
        """Publish all samples and return how many; stops early when the process is to end."""
        recording = self._recording
        self._wait_for_listener()
        size = max(1, round(BLOCK / recording.period))
        fields = {name: list(kind.get_fields_and_field_types()) for name, (kind, _) in
                  self._topics.items()}
        start = round(recording.start * SECOND)
        begin = time.monotonic()
        sent = 0
        for at in range(0, len(recording), size):
            end = min(len(recording), at + size)
            instant = start + round(at * recording.period * SECOND)
            rest = begin + end * recording.period / self._rate - time.monotonic()
            if rest > 0.0:
                time.sleep(rest)
            if self._ending.asked:
                break
            self._clock.publish(Clock(clock=to_time(
                start + round(end * recording.period * SECOND))))
            for name, (kind, publisher) in self._topics.items():
                message = kind()
                message.header.stamp = to_time(instant)
                message.sequence = recording.sequence + at
                message.period = recording.period
                for field in fields[name]:
                    if field in recording.columns:
                        part = np.ascontiguousarray(recording[field][at:end])
                        setattr(message, field, array('d', part.tobytes()))
                publisher.publish(message)
            sent = end
        for _, publisher in self._topics.values():
            publisher.wait_for_all_acked(rclpy.duration.Duration(seconds=2.0))
        return sent

    def _wait_for_listener(self) -> None:
        until = time.monotonic() + _MATCH
        publishers = [publisher for _, publisher in self._topics.values()]
        while time.monotonic() < until and not self._ending.asked:
            if all(publisher.get_subscription_count() for publisher in publishers):
                return
            time.sleep(0.02)


def play(bag: Path, rate: float, namespace: str | None, stretch: int | None) -> int:
    """Play a bag into the graph and return the exit status; raises ValueError for a bad rate."""
    if not 0.0 < rate <= 1000.0:
        raise ValueError(f'--rate {rate:g} is outside (0, 1000]')
    recording = read_recording(bag, namespace, stretch)
    where = namespace if namespace is not None else namespaces(bag)[0]
    ending = started()
    node = GraphReplay(recording, rate, where, ending)
    try:
        sent = node.play()
        print(f'{recording.name}: {sent} of {len(recording)} samples published at {rate:g} times '
              f'real time')
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0 if sent == len(recording) else 1
