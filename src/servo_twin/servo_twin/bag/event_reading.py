"""Reads what happened, and what changed in a twin, while a bag was recorded."""

from __future__ import annotations

from pathlib import Path

from ..recording.events import beside, Change, CHANGES, Happened, obeyed
from ..recording.parts import LongRecording
from .bag_writing import BagError
from .mcap_reading import DAMAGE
from .message_definitions import deserialize, embedded_types, PACKAGE
from .message_sources import open_source, Source

KIND = f'{PACKAGE}/msg/Event'


def read_events(bag: Path, namespace: str | None = None) -> list[Happened]:
    """
    Return what happened while a bag was recorded, in its order.

    ``namespace`` picks the rig of a bag with several. Of a bag that was cut, what stands in its
    whole chunks is returned; what is no bag has none.
    """
    topic = None if namespace is None else f'/{namespace.strip("/")}/events'.replace('//', '/')
    try:
        with open_source(bag) as source:
            topics = [c.topic for c in source.channels
                      if c.kind == KIND and topic in (None, c.topic)]
            return [one for piece in source.pieces(topics)
                    for one in _happened(source, piece, topics)]
    except BagError:
        return []


def _happened(source: Source, piece: object, topics: list[str]) -> list[Happened]:
    """Return what a stretch of a bag tells, by its stamps; nothing of a damaged one."""
    found = []
    try:
        for channel, several in source.load(piece, topics):
            types = embedded_types(channel.kind, channel.encoding, channel.definition)
            for m in (deserialize(types, KIND, bytes(one)) for rows in several for one in rows):
                found.append(Happened(m.header.stamp.sec * 10**9 + m.header.stamp.nanosec,
                                      m.source, m.kind, m.text, int(m.sequence), m.content))
    except (*DAMAGE, AttributeError):  # an Event of another version lacks a field
        return []
    return sorted(found, key=lambda one: one.stamp)


def read_changes(bag: Path, namespace: str | None = None,
                 recording: LongRecording | None = None) -> list[Change]:
    """
    Return what a replay of a bag's twin obeys, in its order; see read_events.

    With ``recording``, what was beside its driver, where the bag has several.
    """
    changes = [Change(one.sequence, one.kind, one.content)
               for one in read_events(bag, namespace) if one.kind in CHANGES]
    if recording is not None:
        zero = recording.start - recording.sequence * recording.period
        changes = beside(changes, round(zero * 1e9))
    return obeyed(changes)
