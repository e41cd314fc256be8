"""The residuals as scalars at a plotting rate, for PlotJuggler and Foxglove."""

from __future__ import annotations

import numpy as np
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile

from servo_twin_msgs.msg import PlotResidual

from ..lockstep.lockstep import Answer
from ..recording.recording import BALANCES, COMPARED
from .message_conversion import to_time

TOPIC = 'twin/plot/residual'


class PlotResiduals:
    """
    Publishes, of all samples since the message before, what departs most, with its sign.

    ``rate`` of publishing in Hz, 0: never. Sample times count, so a replay plots the same.
    """

    def __init__(self, node: LifecycleNode) -> None:
        self.publisher = node.create_lifecycle_publisher(PlotResidual, TOPIC,
                                                         QoSProfile(depth=100))
        self._message = PlotResidual()
        self._most = np.full(len(COMPARED) + len(BALANCES), np.nan)
        self._begin: int | None = None

    def take(self, residual: Answer, period: float, rate: float, frame: str = '') -> None:
        """Take a block of residuals (period of its samples in s, TF frame); publish when due."""
        if not rate or not len(residual.values):
            return
        last = residual.stamp + round((len(residual.values) - 1) * period * 1e9)
        self._most = _largest(np.vstack([self._most, residual.values]))
        if self._begin is None or last < self._begin:
            self._begin = residual.stamp
        if (last - self._begin) * 1e-9 + period < (1.0 - 1e-6) / rate:
            return
        message = self._message
        message.header.stamp, message.header.frame_id = to_time(last), frame
        message.sequence = residual.sequence + len(residual.values) - 1
        for name, value in zip(COMPARED + BALANCES, self._most, strict=True):
            setattr(message, name, float(value))
        self.publisher.publish(message)
        self._most[:], self._begin = np.nan, None


def _largest(rows: np.ndarray) -> np.ndarray:
    """Return the value of the largest magnitude in each column; NaN where all are."""
    sizes = np.where(np.isnan(rows), -1.0, np.abs(rows))
    return rows[sizes.argmax(axis=0), np.arange(rows.shape[1])]
