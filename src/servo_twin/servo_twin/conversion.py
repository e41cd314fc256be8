"""Messages of the twin: the only file of it, besides the node, that touches them."""

from __future__ import annotations

from array import array
from collections.abc import Mapping

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
import numpy as np

from servo_twin_msgs.msg import Current, Encoder, Prediction, Residual, Torque

from .lockstep import Answer
from .recording import BALANCES, COMPARED, PREDICTED
from .samples import CHANNELS

SECOND = 1_000_000_000
TOPICS = {'encoder': Encoder, 'torque': Torque, 'current': Current}
"""What a rig says of its samples, relative to its namespace."""

_FIELDS = {
    'encoder': ('motor_position', 'load_position'),
    'torque': ('torque', 'external_torque'),
    'current': ('current', 'voltage', 'current_reference', 'reference_velocity',
                'reference_position', 'temperature'),
}
_PLACES = [(topic, field, CHANNELS.index(field))
           for topic, fields in _FIELDS.items() for field in fields]


def to_time(instant: int) -> Time:
    """Return an instant in ns as a message."""
    return Time(sec=instant // SECOND, nanosec=instant % SECOND)


def to_instant(stamp: Time) -> int:
    """Return a stamp as ns."""
    return stamp.sec * SECOND + stamp.nanosec


def to_samples(parts: Mapping[str, Encoder | Torque | Current]) -> np.ndarray:
    """
    Return the samples of messages with the same sequence, shape (n, len(CHANNELS)).

    Raises ValueError when an array is as long as no other.
    """
    size = len(parts['encoder'].motor_position)
    samples = np.empty((size, len(CHANNELS)))
    for topic, field, column in _PLACES:
        values = getattr(parts[topic], field)
        if len(values) != size:
            raise ValueError(f'{topic}.{field} of sequence {parts[topic].sequence} has '
                             f'{len(values)} samples, encoder.motor_position has {size}')
        samples[:, column] = values
    return samples


def to_prediction(answer: Answer, period: float, restarts: int, frame: str) -> Prediction:
    """Return the message of a prediction; ``period`` in s."""
    message = _filled(Prediction(), answer, PREDICTED, period, frame)
    message.restarts = restarts
    return message


def to_residual(answer: Answer, period: float, channel_noise: np.ndarray,
                balance_noise: np.ndarray, frame: str) -> Residual:
    """Return the message of a residual; noise floors as of Balances."""
    message = _filled(Residual(), answer, COMPARED + BALANCES, period, frame)
    message.channel_noise = channel_noise
    message.balance_noise = balance_noise
    return message


def _filled(message, answer: Answer, fields: tuple[str, ...], period: float, frame: str):
    message.header.stamp = to_time(answer.stamp)
    message.header.frame_id = frame
    message.sequence = answer.sequence
    message.period = period
    for field, column in zip(fields, answer.values.T, strict=True):
        setattr(message, field, array('d', column.tobytes()))
    return message


def to_diagnostics(name: str, level: int, said: str, facts: Mapping[str, str], now: int
                   ) -> DiagnosticArray:
    """Return the health of a twin as one status; ``level`` as of DiagnosticStatus, now in ns."""
    message = DiagnosticArray()
    message.header.stamp = to_time(now)
    message.status = [DiagnosticStatus(
        level=bytes([level]), name=f'{name}: twin', message=said, hardware_id=name,
        values=[KeyValue(key=key, value=value) for key, value in facts.items()])]
    return message
