"""Messages of the twin: the only file of it, besides the node, that touches them."""

from __future__ import annotations

from array import array
from collections.abc import Mapping

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
import numpy as np

from servo_twin_msgs.msg import Current, Encoder, Prediction, Residual, Torque

from ..lockstep.lockstep import Answer
from ..recording.joined_samples import CHANNELS
from ..recording.recording import BALANCES, COMPARED, MAY_BE_EMPTY, PREDICTED

SECOND = 1_000_000_000
TOPICS = {'encoder': Encoder, 'torque': Torque, 'current': Current}
"""What a rig says of its samples, relative to its namespace."""

_FIELDS = {
    'encoder': ('motor_position', 'load_position'),
    'torque': ('torque', 'external_torque'),
    'current': ('current', 'voltage', 'current_reference', 'reference_velocity',
                'reference_position', 'temperature', 'added_command'),
}
_PLACES = [(topic, field, CHANNELS.index(field))
           for topic, fields in _FIELDS.items() for field in fields]
PERIODS = 1e-5, 1.0
"""From one sample to the next, s."""
LAST_SEQUENCE, LAST_SECOND = 1 << 62, (1 << 31) - 86_401
"""With room behind them for what is counted on from there."""


def to_time(instant: int) -> Time:
    """Return an instant in ns as a message."""
    return Time(sec=instant // SECOND, nanosec=instant % SECOND)


def to_instant(stamp: Time) -> int:
    """Return a stamp as ns."""
    return stamp.sec * SECOND + stamp.nanosec


def check(message: Encoder | Residual | Prediction) -> None:
    """Raise ValueError for a message whose period, number or stamp no samples can have."""
    kind = type(message).__name__
    for name, value, (low, high) in (
            ('period', message.period, PERIODS),
            ('sequence', message.sequence, (0, LAST_SEQUENCE)),
            ('header.stamp.sec', message.header.stamp.sec, (0, LAST_SECOND))):
        if not low <= value <= high:
            raise ValueError(f'{kind}.{name} = {value} is outside [{low}, {high}]')


def to_samples(parts: Mapping[str, Encoder | Torque | Current]) -> np.ndarray:
    """
    Return the samples of messages with the same sequence, shape (n, len(CHANNELS)).

    Raises ValueError when an array is as long as no other, and see :func:`check`.
    """
    check(parts['encoder'])
    size = len(parts['encoder'].motor_position)
    samples = np.empty((size, len(CHANNELS)))
    for topic, field, column in _PLACES:
        values = getattr(parts[topic], field)
        if field in MAY_BE_EMPTY and not len(values):
            samples[:, column] = np.nan
            continue
        if len(values) != size:
            raise ValueError(f'{topic}.{field} of sequence {parts[topic].sequence} has '
                             f'{len(values)} samples, encoder.motor_position has {size}')
        samples[:, column] = values
    return samples


class Outgoing:
    """
    One kind of answer on its way out.

    The message is the same object each time, filled again: what is published is serialised at
    once, and making a message costs as much as sending it.
    """

    def __init__(self, kind: type[Prediction] | type[Residual]) -> None:
        self.message = kind()
        self.frame = ''
        """TF frame: that of the samples which are answered."""
        self._fields = PREDICTED if kind is Prediction else COMPARED + BALANCES

    def filled(self, answer: Answer, period: float, **others: object) -> Prediction | Residual:
        """Return the message with an answer, the period in s, and ``others`` of its fields."""
        message, stamp = self.message, self.message.header.stamp
        message.header.frame_id = self.frame
        stamp.sec, stamp.nanosec = divmod(answer.stamp, SECOND)
        message.sequence, message.period = answer.sequence, period
        for field, column in zip(self._fields, answer.values.T, strict=True):
            setattr(message, field, array('d', column.tobytes()))
        for field, value in others.items():
            setattr(message, field, value)
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
