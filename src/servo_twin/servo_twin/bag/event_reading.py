"""Reads what changed in a twin while a bag was recorded."""

from __future__ import annotations

from pathlib import Path

from rosbags.highlevel import AnyReader

from ..recording.events import Change, PARAMETERS, SERVO_FILE
from .message_definitions import PACKAGE

KIND = f'{PACKAGE}/msg/Event'


def read_changes(bag: Path, namespace: str | None = None) -> list[Change]:
    """
    Return the changes of parameters and servo file of a bag's twin, in their order.

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
    return [Change(int(m.sequence), m.kind, m.content) for m in messages
            if m.kind in (PARAMETERS, SERVO_FILE)]
