"""Loss counted from the sequence numbers of serialized sample messages."""

from __future__ import annotations

from dataclasses import dataclass
from struct import unpack_from

SEQUENCED = ('servo_twin_msgs/msg/Encoder', 'servo_twin_msgs/msg/Torque',
             'servo_twin_msgs/msg/Current')
"""Messages that begin with header, sequence, period and a list of samples."""


def block_of(data: bytes) -> tuple[int, int]:
    """
    Return (sequence, samples) of a serialized message of :data:`SEQUENCED`.

    CDR, little endian: 4 bytes of encapsulation, stamp (8), frame_id (length word and text), then
    at the next multiple of 8 the sequence, the period and the length of the first list. Raises
    struct.error when the message is shorter than that.
    """
    frame = unpack_from('<I', data, 12)[0]
    sequence, _, samples = unpack_from('<QdI', data, 4 + (12 + frame + 7) // 8 * 8)
    return sequence, samples


@dataclass
class SequenceWatch:
    """Counts what is missing between consecutive messages of one topic."""

    samples: int = 0
    lost: int = 0
    gaps: int = 0
    restarts: int = 0
    expected: int | None = None

    def take(self, sequence: int, samples: int) -> None:
        """Take in a message of ``samples`` samples that begins at ``sequence``."""
        if self.expected is not None and sequence > self.expected:
            self.lost += sequence - self.expected
            self.gaps += 1
        elif self.expected is not None and sequence < self.expected:
            self.restarts += 1
        self.samples += samples
        self.expected = sequence + samples

    def __str__(self) -> str:
        restarts = f', {self.restarts} restarts' if self.restarts else ''
        return f'{self.samples} samples, {self.lost} lost in {self.gaps} gaps{restarts}'
