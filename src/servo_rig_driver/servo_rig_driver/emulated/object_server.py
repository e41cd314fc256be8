"""The object dictionaries of the emulated nodes, served to SDO clients by canopen's LocalNode."""

from __future__ import annotations

from collections.abc import Callable

import can
from canopen import LocalNode, Network

from ..devices.pdo_table import Field, FrameTable

HEARTBEAT_TIME, WATCHDOG = 0x1017, 0x2010
_SETTINGS = (HEARTBEAT_TIME, WATCHDOG)

Send = Callable[[list[tuple[int, bytes]]], None]


class _Outlet:
    """What canopen takes for its bus: messages leave by the rig's own way."""

    def __init__(self, send: Send) -> None:
        self._send = send

    def send(self, message: can.Message) -> None:
        self._send([(message.arbitration_id, bytes(message.data))])


class Objects:
    """
    Answers SDO for all nodes of a rig.

    ``read(node, index, field)`` returns the integer of a live object, None for one that is not;
    ``field`` is that of the frame table, None where no TPDO carries the object. ``wrote(node,
    index, integer, value)`` hears of every write that the dictionary allows.
    """

    def __init__(self, frames: FrameTable, send: Send,
                 read: Callable[[str, int, Field | None], int | None],
                 wrote: Callable[[str, int, int, float], None]) -> None:
        self._network = Network(_Outlet(send))
        self._read = read
        self._wrote = wrote
        self._identifiers = {0x600 + number for number in frames.ids.values()}
        self._nodes = {name: self._node(name, frames) for name in frames.ids}
        self._settings = {}
        for name, node in self._nodes.items():
            for index in _SETTINGS:
                if index in node.object_dictionary:
                    entry = node.object_dictionary[index]
                    self._settings[name, index] = entry.default * entry.factor

    def take(self, identifier: int, data: bytes, now: float) -> None:
        """Answer a request if this identifier is that of an SDO server of the rig."""
        if identifier in self._identifiers:
            self._network.notify(identifier, bytearray(data), now)

    def setting(self, node: str, index: int) -> float:
        """Return HEARTBEAT_TIME (s) or WATCHDOG (SYNCs) of a node; 0 where it has none."""
        return self._settings.get((node, index), 0)

    def stored(self, node: str, index: int) -> float:
        """Return what an object of a node holds, scaled."""
        return self._nodes[node].sdo[index].phys

    def _node(self, name: str, frames: FrameTable) -> LocalNode:
        node = LocalNode(frames.ids[name], frames.dictionaries.nodes[name])
        node.nmt.start_heartbeat = lambda milliseconds: None  # RigNodes.tick() sends them
        node.associate_network(self._network)
        fields = {(field.index, field.subindex): field for frame in frames.values()
                  if frame.transmitted and frame.name.startswith(name + '.')
                  for field in frame.fields}

        def read(index: int, subindex: int, od: object) -> int | None:
            return self._read(name, index, fields.get((index, subindex)))

        def wrote(index: int, subindex: int, od: object, data: bytes) -> None:
            raw = od.decode_raw(data)
            if index in _SETTINGS:
                self._settings[name, index] = raw * od.factor
            self._wrote(name, index, raw, raw * od.factor)

        node.add_read_callback(read)
        node.add_write_callback(wrote)
        return node
