"""
CAN frames as bytes on a Unix socket, in the layouts of Linux: struct can_frame and canfd_frame.

A packet holds one frame or several, all classic (16 bytes each) or all CAN FD (72 bytes each).
Before them may stand an expiry: until when the hub shall pass them on, and by which tag the sender
knows them. The hub gives the expiry alone back where it was too late. This is the only file that
knows the layouts.
"""

from __future__ import annotations

from struct import Struct

EXPIRY = Struct('<IIq')  # EXPIRES, tag, until: ns of CLOCK_MONOTONIC, one for all processes
EXPIRES = 0xFFFFFFFF  # no frame begins so: a remote frame that is an error frame
TAGS = 1 << 32
LAYOUT = Struct('<IB3x8s')  # identifier with flags, data length, padding, data
FD_LAYOUT = Struct('<IBB2x64s')  # the same with the flags of canfd_frame
EXTENDED, REMOTE, ERROR = 0x80000000, 0x40000000, 0x20000000
FD = 0x1_00000000
"""Marks an identifier whose frame is CAN FD; beyond the 32 bits of Linux's can_id."""
STANDARD_MASK, EXTENDED_MASK = 0x7FF, 0x1FFFFFFF
FD_SIZES = (*range(9), 12, 16, 20, 24, 32, 48, 64)
MOST_FRAMES = 256  # classic frames in one packet
LARGEST = MOST_FRAMES * LAYOUT.size  # bytes of the frames in a packet
GREETING = b'CAN hub 1'  # the hub's first packet: from now on the client hears everything

_FDF, _BRS = 0x04, 0x01  # of canfd_frame's flags: it is CAN FD, its data at the higher rate
_FLAGS_AT = 5
_CAN_ID = FD - 1
_FILL = tuple(bytes(8 - n) for n in range(9))


class BadFrame(ValueError):
    """Bytes that are no CAN frame; the text says why."""


def to_bytes(identifier: int, data: bytes) -> bytes:
    """
    Return the bytes of a frame; ``identifier`` carries the flags of Linux's can_id, and FD.

    Raises BadFrame for a number of data bytes that such a frame cannot have.
    """
    size = len(data)
    if identifier & FD:
        if size not in FD_SIZES:
            raise BadFrame(f'frame 0x{identifier & _CAN_ID:X} has {size} data bytes; a CAN FD '
                           f'frame has one of {list(FD_SIZES)}')
        return FD_LAYOUT.pack(identifier & _CAN_ID, size, _FDF | _BRS, bytes(data))
    if size > 8:
        raise BadFrame(f'frame 0x{identifier:X} has {size} data bytes; a CAN frame has 0 to 8')
    return LAYOUT.pack(identifier, size, bytes(data) + _FILL[size])


def expiry_of(packet: bytes) -> tuple[int, int] | None:
    """Return (tag, until in ns of CLOCK_MONOTONIC) of a packet that has an expiry, else None."""
    if len(packet) < EXPIRY.size:
        return None
    mark, tag, until = EXPIRY.unpack_from(packet)
    return (tag, until) if mark == EXPIRES else None


def from_bytes(packet: bytes) -> list[tuple[int, bytes]]:
    """
    Return the frames of a packet as (identifier with flags, data), in their order.

    Raises BadFrame when the packet is not made of whole, well-formed frames of one kind.
    """
    size = len(packet)
    if size % FD_LAYOUT.size == 0 and size and packet[_FLAGS_AT] & _FDF:
        return _fd_frames(packet)
    if size % LAYOUT.size or not 0 < size <= LARGEST:
        raise BadFrame(f'{size} bytes are no CAN frames; a packet has 1 to {MOST_FRAMES} frames '
                       f'of {LAYOUT.size} bytes')
    frames = []
    for identifier, length, data in LAYOUT.iter_unpack(packet):
        if length > 8:
            raise BadFrame(f'frame 0x{identifier:X} claims {length} data bytes; a CAN frame has '
                           '0 to 8')
        _check(identifier)
        frames.append((identifier, data[:length]))
    return frames


def _fd_frames(packet: bytes) -> list[tuple[int, bytes]]:
    if len(packet) > LARGEST:
        raise BadFrame(f'a packet has {len(packet)} bytes; it has at most {LARGEST}')
    frames = []
    for identifier, length, flags, data in FD_LAYOUT.iter_unpack(packet):
        if not flags & _FDF or length not in FD_SIZES or identifier & REMOTE:
            raise BadFrame(f'frame 0x{identifier:X} with {length} data bytes and flags '
                           f'0x{flags:02X} is no CAN FD frame')
        _check(identifier)
        frames.append((identifier | FD, data[:length]))
    return frames


def _check(identifier: int) -> None:
    if not identifier & EXTENDED and identifier & EXTENDED_MASK > STANDARD_MASK:
        raise BadFrame(f'identifier 0x{identifier & EXTENDED_MASK:X} of a standard frame '
                       f'exceeds 0x{STANDARD_MASK:X}')
