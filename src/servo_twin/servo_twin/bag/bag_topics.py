"""What the topics of a rig and its twin carry: their messages, and the columns of a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..recording.recording import MAY_BE_EMPTY, Recording

SAMPLE_TOPICS = {
    'encoder': ('Encoder', ('motor_position', 'load_position')),
    'torque': ('Torque', ('torque', 'external_torque')),
    'current': ('Current', ('current', 'voltage', 'current_reference', 'reference_velocity',
                            'reference_position', 'temperature', 'added_command')),
}
"""Topic of a rig: its message and the columns of a recording that it carries."""

COUPLED_TOPIC = 'coupled/encoder'
COUPLED_COLUMN, COUPLED_FIELD = 'coupled_position', 'load_position'
"""
What another axis read that this one carries: the topic of a rig that has one, an Encoder message
with this rig's sequence numbers; the column of a recording; the field that it comes from.
"""

TWIN_TOPICS = {'prediction': ('twin/prediction', 'Prediction'),
               'residual': ('twin/residual', 'Residual')}
"""Part of the twin's answer: its topic and its message."""


@dataclass(frozen=True)
class Samples:
    """
    What one topic carries over a run of samples.

    ``columns`` maps field names of ``message`` to arrays of shape (samples,); ``constants`` gives
    the fields that are the same in every message. What is named in neither is NaN (lists, as long
    as the columns; empty those of MAY_BE_EMPTY) or 0.
    """

    message: str
    columns: Mapping[str, np.ndarray]
    constants: Mapping[str, Any] = field(default_factory=dict)


def sample_topics(recording: Recording, coupled: bool) -> dict[str, Samples]:
    """Return what the rig's topics carry; ``coupled``: whether another axis is one of them."""
    topics = {topic: Samples(message, {name: recording[name] for name in names
                                       if name not in MAY_BE_EMPTY or recording.has(name)})
              for topic, (message, names) in SAMPLE_TOPICS.items()}
    if coupled:
        topics[COUPLED_TOPIC] = Samples('Encoder', {COUPLED_FIELD: recording[COUPLED_COLUMN]})
    return topics
