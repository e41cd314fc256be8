"""Reads what changed and happened while a bag was recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader

from ..recording.events import Change, Happening, PARAMETERS, SERVO_FILE
from .message_definitions import PACKAGE

KIND = f'{PACKAGE}/msg/Event'


def read_changes(bag: Path, namespace: str | None = None) -> list[Change]:
    """
    Return the changes of parameters and servo file of a bag's twin, in their order.

    ``namespace`` picks the rig of a bag with several. A bag that was cut, or that is no folder of
    rosbag2, has none that can be read.
    """
    return [Change(int(m.sequence), m.kind, m.content) for m in _messages(bag, namespace)
            if m.kind in (PARAMETERS, SERVO_FILE)]


def read_happenings(bag: Path, namespace: str | None = None) -> list[Happening]:
    """Return all that was told beside the samples, in its order; arguments as above."""
    return [Happening(m.header.stamp.sec + m.header.stamp.nanosec * 1e-9, m.source, m.kind, m.text)
            for m in _messages(bag, namespace)]


def _messages(bag: Path, namespace: str | None) -> list[Any]:
    if not (bag / 'metadata.yaml').is_file():
        return []
    topic = None if namespace is None else f'/{namespace.strip("/")}/events'.replace('//', '/')
    with AnyReader([bag]) as reader:
        chosen = [c for c in reader.connections
                  if c.msgtype == KIND and topic in (None, c.topic)]
        return [reader.deserialize(raw, KIND) for _, _, raw in reader.messages(chosen)
                ] if chosen else []
