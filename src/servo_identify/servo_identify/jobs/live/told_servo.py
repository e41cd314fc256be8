"""What servo file a twin runs by what it says: a whole file, or the values that were set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

from servo_twin.description import servo_file
from servo_twin.lockstep.live_changes import changed
from servo_twin.physics.servo import Servo, Value
from servo_twin.recording.events import Change, Happened, PARAMETERS


def running_after(running: str, kind: str, content: str) -> str:
    """
    Return the servo file that a twin runs after an event of it; ``running`` where it is the same.

    ``kind`` and ``content`` are those of Event.msg. Raises ValueError, which ServoError is, for
    what no twin says, and for a servo file that would bring code of its own.
    """
    try:
        then = (_changed(running, Change(0, kind, content).values) if kind == PARAMETERS
                else Happened(0, '', kind, '', content=content).servo_file)
    except (AttributeError, RecursionError):
        raise ValueError(f'{kind}: {content[:80]!r} is not what a twin says') from None
    return running if same(then, running) else then


def same(text: str, known: str) -> bool:
    """
    Whether a text that the twin told says what a known servo file does, wherever values are from.

    Raises ServoError for a text that is no servo file, or that would bring code of its own.
    """
    if text in (known, servo_file.dumps(_read(known))):
        return True
    return _bare(servo_file.loads(text, 'the servo file of the twin', code=False)) == _bare(
        _read(known))


def _changed(running: str, values: Mapping[str, Value]) -> str:
    return servo_file.dumps(changed(_read(running), values))


@lru_cache(maxsize=4)
def _read(known: str) -> Servo:
    """Read a servo file that this node was given, or has looked at before."""
    return servo_file.loads(known, 'the servo file that runs')


def _bare(servo: Servo) -> Servo:
    """Return a servo without the word where its values come from."""
    return replace(servo, provenance={})
