"""
Expedited SDO downloads: writing an object of up to four bytes on a node, as frames.

Pure logic; one transfer at a time on each node. Source: CiA 301, service data objects.
"""

from __future__ import annotations

REQUEST_ID = 0x600  # plus the node id
RESPONSE_ID = 0x580
_COMMANDS = {1: 0x2F, 2: 0x2B, 4: 0x23}
_STORED, _ABORTED = 0x60, 0x80


def write_request(node: int, index: int, value: int, size: int) -> tuple[int, bytes]:
    """
    Return the frame that writes ``value`` to object ``index``, sub-index 0, of ``size`` bytes.

    Raises ValueError for a size that is not 1, 2 or 4, or a value that does not fit it.
    """
    if size not in _COMMANDS or not 0 <= value < 1 << 8 * size:
        raise ValueError(f'object {index:04X}h = {value} does not fit {size} bytes; an object '
                         'written here has 1, 2 or 4')
    data = bytes([_COMMANDS[size]]) + index.to_bytes(2, 'little') + b'\x00'
    return REQUEST_ID + node, data + value.to_bytes(4, 'little')


def write_response(data: bytes) -> tuple[int, int | None] | None:
    """Return (index, abort code or None when it was stored); None for any other frame."""
    if len(data) != 8 or data[0] not in (_STORED, _ABORTED):
        return None
    index = int.from_bytes(data[1:3], 'little')
    return index, int.from_bytes(data[4:8], 'little') if data[0] == _ABORTED else None
