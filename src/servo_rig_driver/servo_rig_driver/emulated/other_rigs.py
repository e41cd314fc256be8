"""Whether another rig on the bus has the node ids of this one, and which of the two was first."""

from __future__ import annotations

from collections.abc import Callable
import logging

from ..can_bus.unix_frames import EXTENDED_MASK

BOOT_UP = b'\x00'

log = logging.getLogger('emulated_rig')


class OtherRigs:
    """
    Judges each frame by ``own``, which names the node of this rig that alone sends it, or none.

    Who boots comes after who speaks already. A rig that has been on the bus for ``slowest`` s, the
    longest time between two beats, was first. A kind that speaks only when it is asked is heard
    as soon as a driver asks. So a rig that comes to one that is driven leaves. Of two that were
    not driven yet neither knows who was first; the driver leaves both off.
    """

    def __init__(self, own: Callable[[int, bytes], str], slowest: float, where: str) -> None:
        self._own, self._slowest, self._where = own, slowest, where
        self._spoke: float | None = None
        self._first = self._told = False

    def speak(self, now: float) -> None:
        """Note that this rig is about to speak, at ``now`` s."""
        self._spoke = now if self._spoke is None else self._spoke

    def was_there_before(self, identifier: int, data: bytes, now: float) -> bool:
        """Whether a frame is that of a rig that was on the bus before this one, which is said."""
        node = self._own(identifier, data)
        if not node:
            return False
        if self._spoke is not None:
            self._first |= data == BOOT_UP or now - self._spoke >= self._slowest
        if not self._told:
            log.error('another %s speaks under 0x%03X on %s: end %s, or give one of the two '
                      'another --channel or id', node.replace('_', ' '),
                      identifier & EXTENDED_MASK, self._where,
                      'it' if self._first else 'the other rig')
        self._told = True
        return not self._first
