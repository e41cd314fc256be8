"""What CANopen nodes say beside samples: heartbeats, emergencies, SDO; and other masters."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ..driver.rig_health import Heartbeats
from ..driver.rig_watch import RigWatch
from .pdo_table import HEARTBEAT_ID
from .sdo import RESPONSE_ID, write_response

EMERGENCY_ID = 0x80
_ERRORS = {
    0x2300: 'current at the output', 0x2310: 'over-current', 0x2320: 'short circuit',
    0x3110: 'mains over-voltage', 0x3120: 'mains under-voltage', 0x3210: 'DC link over-voltage',
    0x3220: 'DC link under-voltage', 0x4210: 'over-temperature of the drive',
    0x4310: 'over-temperature of the motor', 0x7300: 'sensor', 0x8130: 'no heartbeat heard',
    0x8250: 'no set-points heard', 0x8611: 'following error', 0x8700: 'no SYNC heard',
    0x1000: 'generic', 0x2000: 'current', 0x3000: 'voltage', 0x4000: 'temperature',
    0x5000: 'device hardware', 0x6000: 'device software', 0x7000: 'additional modules',
    0x8000: 'monitoring', 0x9000: 'external', 0xF000: 'additional functions',
    0xFF00: 'specific to the device'}
"""Error codes in words, the exact ones and the classes. Source: CiA 301 table 26, CiA 402-2."""

_MISSED = (0x8130, 0x8250, 0x8700)
"""Those of a drive that did not hear the driver in time."""


def error_words(code: int) -> str:
    """Return an emergency error code (object 603Fh) in words: its own, or those of its class."""
    known = (_ERRORS.get(code & mask) for mask in (0xFFFF, 0xFFF0, 0xFF00, 0xF000))
    return next((words for words in known if words), f'0x{code:04X}')


class CanopenListener:
    """
    Tells a RigWatch what it hears.

    ``masters`` names the frames that only a driver sends, ``stops`` says of one whether it takes
    the torque away. ``stored`` holds (node, index) of
    objects that a node has taken, or refused, to store, and ``twice`` the nodes that answered one
    such request twice since it was emptied. ``emergency`` is the drive's last error in words, and
    ``missed`` whether it is that frames of the driver did not come.
    """

    def __init__(self, watch: RigWatch, masters: Mapping[int, str],
                 stops: Callable[[int, bytes], bool | None]) -> None:
        self.watch = watch
        self.stored: set[tuple[int, int]] = set()
        self.twice: set[int] = set()
        self.emergency = ''
        self.missed = False
        self._masters = masters
        self._stops = stops

    def take(self, identifier: int, data: bytes, now: int) -> None:
        """Take a frame that is no answer to SYNC."""
        node = identifier & 0x7F
        function = identifier & ~0x7F
        if identifier in self._masters:
            self.watch.hear_foreign(f'{self._masters[identifier]} (0x{identifier:03X})', now,
                                    self._stops(identifier, data))
        elif node not in self.watch.nodes:
            return
        elif function == HEARTBEAT_ID and len(data) == 1:
            if data[0] == Heartbeats.BOOT_UP or self._fell_back(node, data[0]):
                self.watch.booted(node)
            self.watch.beats.beat(node, data[0], now)
        elif function == RESPONSE_ID:
            self._response(node, data, now)
        elif function == EMERGENCY_ID and len(data) == 8:
            self._emergency(node, data, now)
        elif function in (HEARTBEAT_ID, EMERGENCY_ID):
            length = 1 if function == HEARTBEAT_ID else 8
            self.watch.health.event(
                'nodes.wrong_length', f'{self.watch.name(node)} sent 0x{identifier:03X} with '
                f'{len(data)} bytes, expected {length}; left out', now)

    def _fell_back(self, node: int, state: int) -> bool:
        """Whether a node that ran waits to be started: it booted, and nobody heard it say so."""
        was = self.watch.beats.state.get(node)
        return was == Heartbeats.OPERATIONAL and state & 0x7F == Heartbeats.PRE_OPERATIONAL

    def _response(self, node: int, data: bytes, now: int) -> None:
        response = write_response(data)
        if response is None:
            return
        index, abort = response
        if (node, index) in self.stored:
            self.twice.add(node)
        self.stored.add((node, index))
        if abort is not None:
            self.watch.health.event(
                'nodes.refusal', f'{self.watch.name(node)} refuses object {index:04X}h, abort '
                f'code 0x{abort:08X}; it keeps its own value', now)

    def _emergency(self, node: int, data: bytes, now: int) -> None:
        code = data[0] | data[1] << 8
        who = self.watch.nodes[node]
        key = 'drive.emergency' if who == 'drive' else f'nodes.{who}_emergency'
        words = error_words(code) if code else ''
        if who == 'drive':
            self.emergency = words
            self.missed = code in _MISSED
        if code == 0:
            self.watch.health.over(key, now)
            return
        self.watch.health.count(f'{key}_frames')
        self.watch.health.trouble(
            key, f'{self.watch.name(node)} reports emergency 0x{code:04X} ({words}), error '
            f'register 0x{data[2]:02X}', now)
