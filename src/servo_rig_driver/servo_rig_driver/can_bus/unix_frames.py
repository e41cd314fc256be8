"""
CAN frames as bytes on a Unix socket: the layout of Linux's struct can_frame, 16 bytes each.

A packet holds one frame or several. This is the only file that knows the layout.
"""

from __future__ import annotations

from struct import Struct

LAYOUT = Struct('<IB3x8s')  # identifier with flags, data length, padding, data
EXTENDED, REMOTE, ERROR = 0x80000000, 0x40000000, 0x20000000
STANDARD_MASK, EXTENDED_MASK = 0x7FF, 0x1FFFFFFF
MOST_FRAMES = 256  # frames in one packet
GREETING = b'CAN hub 1'  # the hub's first packet: from now on the client hears everything

_FILL = tuple(bytes(8 - n) for n in range(9))


class BadFrame(ValueError):
    """Bytes that are no CAN frame; the text says why."""


def to_bytes(identifier: int, data: bytes) -> bytes:
    """
    Return the 16 bytes of a frame; ``identifier`` carries the flags of Linux's can_id.

    Raises BadFrame for more than eight data bytes.
    """
    size = len(data)
    if size > 8:
        raise BadFrame(f'frame 0x{identifier:X} has {size} data bytes; a CAN frame has 0 to 8')
    return LAYOUT.pack(identifier, size, bytes(data) + _FILL[size])


def from_bytes(packet: bytes) -> list[tuple[int, bytes]]:
    """
    Return the frames of a packet as (identifier with flags, data), in their order.

    Raises BadFrame when the packet is not made of whole, well-formed frames.
    """
    size = len(packet)
    if size % LAYOUT.size or not 0 < size <= MOST_FRAMES * LAYOUT.size:
        raise BadFrame(f'{size} bytes are no CAN frames; a packet has 1 to {MOST_FRAMES} frames '
                       f'of {LAYOUT.size} bytes')
    frames = []
    for identifier, length, data in LAYOUT.iter_unpack(packet):
        if length > 8:
            raise BadFrame(f'frame 0x{identifier:X} claims {length} data bytes; a CAN frame has '
                           '0 to 8')
        if not identifier & EXTENDED and identifier & EXTENDED_MASK > STANDARD_MASK:
            raise BadFrame(f'identifier 0x{identifier & EXTENDED_MASK:X} of a standard frame '
                           f'exceeds 0x{STANDARD_MASK:X}')
        frames.append((identifier, data[:length]))
    return frames
