"""Reads what happened, and what changed in a twin, while a bag was recorded."""

from __future__ import annotations

from pathlib import Path

from rosbags.highlevel import AnyReader

from ..recording.events import Change, CHANGES, Happened, obeyed
from .message_definitions import PACKAGE

KIND = f'{PACKAGE}/msg/Event'


def read_events(bag: Path, namespace: str | None = None) -> list[Happened]:
    """
    Return what happened while a bag was recorded, in its order.

    ``namespace`` picks the rig of a bag with several. A bag that was cut, or that is no folder of
    rosbag2, has none that can be read.
    """
    if not (bag / 'metadata.yaml').is_file():
        return []
    topic = None if namespace is None else f'/{namespace.strip("/")}/events'.replace('//', '/')
    with AnyReader([bag]) as reader:
        chosen = [c for c in reader.connections
                  if c.msgtype == KIND and topic in (None, c.topic)]
        if not chosen:
            return []
        messages = [reader.deserialize(raw, KIND) for _, _, raw in reader.messages(chosen)]
    return [Happened(m.header.stamp.sec * 10**9 + m.header.stamp.nanosec, m.source, m.kind, m.text,
                     int(m.sequence), m.content) for m in messages]


def read_changes(bag: Path, namespace: str | None = None) -> list[Change]:
    """Return what a replay of a bag's twin obeys, in its order; see read_events."""
    return obeyed([Change(one.sequence, one.kind, one.content)
                   for one in read_events(bag, namespace) if one.kind in CHANGES])
