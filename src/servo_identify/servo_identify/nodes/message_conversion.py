"""Messages of the identify node: the only file, besides the nodes, that touches them."""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
import numpy as np

from servo_twin.nodes.message_conversion import check, to_time
from servo_twin.recording.recording import BALANCES
from servo_twin_msgs.msg import Estimate, Residual

OK, WARN, ERROR, STALE = 0, 1, 2, 3


def to_residuals(message: Residual) -> np.ndarray:
    """
    Return the balances of a message, in noise floors, shape (n, len(BALANCES)).

    Raises ValueError where one is as long as no other, and for a period, number or stamp that no
    samples can have.
    """
    check(message)
    sizes = {name: len(getattr(message, name)) for name in BALANCES}
    if len(set(sizes.values())) != 1:
        raise ValueError(f'Residual of sequence {message.sequence} has {sizes} samples')
    return np.column_stack([getattr(message, name) for name in BALANCES])


def to_status(node: str, part: str, level: int, said: str, facts: Mapping[str, str]
              ) -> DiagnosticStatus:
    """Return the health of one part of a node; ``level`` as of DiagnosticStatus."""
    return DiagnosticStatus(
        level=bytes([level]), name=f'{node}: {part}', message=said, hardware_id=node,
        values=[KeyValue(key=key, value=value) for key, value in facts.items()])


def to_diagnostics(statuses: Sequence[DiagnosticStatus], now: int) -> DiagnosticArray:
    """Return the health of a node at ``now``, ns."""
    message = DiagnosticArray(status=list(statuses))
    message.header.stamp = to_time(now)
    return message


def to_estimate(names: Sequence[str], values: Sequence[float], stds: Sequence[float],
                bounded: Sequence[bool], sequence: int, stamp: int, frame: str) -> Estimate:
    """Return what the online estimator knows after sample ``sequence``, taken at ``stamp`` ns."""
    message = Estimate(sequence=sequence, name=list(names), value=array('d', values),
                       std=array('d', stds), bounded=[bool(b) for b in bounded])
    message.header.stamp = to_time(stamp)
    message.header.frame_id = frame
    return message
