"""Encoders that wrap around at each turn, told by a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ..data.column_units import factor_of
from ..data.mistakes import TURN
from ..data.survey import survey
from .proposals import Proposal


def with_turns(columns: Mapping[str, Proposal], recording: Recording,
               servo: Servo) -> dict[str, Proposal]:
    """Return the columns, with the turn of those that jump back by it in this recording."""
    turned = {name: TURN / factor_of(name, name, columns[name].unit, servo)
              for name in survey(recording, servo).wrapped}
    return {name: replace(one, wraps=turned.get(name, 0.0)) for name, one in columns.items()}
