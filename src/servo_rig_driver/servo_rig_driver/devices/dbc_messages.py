"""Messages of one device by a DBC file, which cantools reads: names and values, no bytes."""

from __future__ import annotations

from collections.abc import Mapping
import re

import cantools

from .device import DeviceError
from .pdo_table import FrameError
from .tables import table_path

LONGEST = 8 * 64
"""Bits of the longest frame, that of CAN FD: cantools takes time and memory for each of them."""
_BYTES = re.compile(r'\bBO_\s+\d+\s+(\w+)\s*:\s*(\d+)')
_BITS = re.compile(r'\bSG_\s+(\w+)[^:"]*:\s*(\d+)\s*\|\s*(\d+)')


class DbcMessages:
    """
    The messages of a DBC file whose identifiers are those of node 0.

    Raises DeviceError for a file that is missing, no DBC, or of frames of more than LONGEST bits.
    """

    def __init__(self, name: str, device: str = 'Axis') -> None:
        self.file = table_path(name, '.dbc')
        self._device = device
        try:
            content = self.file.read_text('cp1252')
            _check_sizes(content)
            database = cantools.database.load_string(content, 'dbc')
            self._by_name = {message.name: message for message in database.messages}
        except Exception as error:  # textparser's, cantools' and plain ValueErrors alike
            raise DeviceError(f'{self.file} is no DBC file that can be read: {error}') from error
        self._by_id = {message.frame_id: name for name, message in self._by_name.items()}

    def need(self, name: str, *signals: str) -> None:
        """Raise DeviceError for a message or a signal that the file lacks."""
        if name not in self._by_name:
            raise DeviceError(f"{self.file} has no message '{name}'; it has "
                              f'{sorted(self._by_name)}')
        known = self._by_name[name].signal_tree
        for signal in signals:
            if signal not in known:
                raise DeviceError(f"{self.file}: message '{name}' has no signal '{signal}'; it "
                                  f'has {known}')

    def identifier(self, name: str) -> int:
        """Return the identifier of a message, that of node 0."""
        return self._by_name[name].frame_id

    def name_of(self, identifier: int) -> str | None:
        """Return the message with this identifier, that of node 0; None where there is none."""
        return self._by_id.get(identifier)

    def from_device(self, name: str) -> bool:
        """Whether the device sends a message."""
        return self._device in self._by_name[name].senders

    def encode(self, name: str, values: Mapping[str, float | str]) -> tuple[int, bytes]:
        """
        Return (identifier of node 0, data) of a message; words stand for choices.

        Raises DeviceError for values that the file does not know or that do not fit.
        """
        message = self._by_name[name]
        try:
            return message.frame_id, message.encode(values)
        except Exception as error:  # cantools', bitstruct's and struct's alike
            raise DeviceError(f"{self.file}: message '{name}' cannot say {dict(values)}: {error}"
                              ) from error

    def decode(self, name: str, data: bytes) -> dict[str, float]:
        """Return the values of a message; raises FrameError for a wrong length."""
        message = self._by_name[name]
        if len(data) != message.length:
            raise FrameError(f'frame 0x{message.frame_id:03X} ({name}) has {len(data)} bytes, '
                             f'expected {message.length}')
        try:
            return message.decode(data, decode_choices=False)
        except Exception as error:  # as above
            raise FrameError(f'frame 0x{message.frame_id:03X} ({name}): {error}') from error

    def words(self, name: str, signal: str, value: int) -> str:
        """Return a value in words, by the choices of its signal."""
        choices = self._by_name[name].get_signal_by_name(signal).choices or {}
        return str(choices.get(value, f'{signal} 0x{value:X}'))


def _check_sizes(content: str) -> None:
    """Raise ValueError for a message, or an end of a signal, that no frame holds."""
    told = [(name, 8 * int(size)) for name, size in _BYTES.findall(content)]
    told += [(name, int(bits)) for name, *both in _BITS.findall(content) for bits in both]
    for name, bits in told:
        if bits > LONGEST:
            raise ValueError(f'{name} needs {bits} bits, and a frame has at most {LONGEST}')
