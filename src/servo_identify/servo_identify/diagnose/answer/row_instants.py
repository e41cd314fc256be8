"""When the command of a row acts, as the recordings show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from servo_twin.recording.recording import Recording

from ..decisions import EVEN
from ..selection.explain import Explained
from ..splitting import Split

BEFORE = 0.5
"""
Rows by which the current of a held command is read late, on average: before its row acts.

Of a winding it is known what flows between the rows.
"""

DELAYS = {'command_delay', 'sensor_delay'}  # a late encoder is as a command that acts late
DRIVEN = {'drive', 'motor', 'torque'}  # equations in which the instant of a command shows


def command_late(found: Explained) -> float:
    """
    Return by how many sample periods the command acts after its row; 0.0 up to half a period.

    Below zero it goes from row to row rather than to be held: a log that is slower than the loop
    sees it in passing.

    A delay that is named, of the command or of a reading that it may stand for, counts from the
    row, so that there it is 0.0. So it is where an equation that tells it is certainly off still:
    what acts there instead may look like it.
    """
    if any(one.mechanism.name in DELAYS for one in found.chosen):
        return 0.0
    if found.search.off_in(found.explanation.smallest) & DRIVEN:
        return 0.0
    measured = any('current' in one.measured.channels for one in found.samples.errors)
    winding = 'drive.resistance' in found.samples.servo.numbers
    on_time = BEFORE if measured and not winding else 0.0
    late = on_time - found.nuisances().get('late:drive', on_time)
    return late if late > EVEN or (late < -0.5 * EVEN and not measured) else 0.0


def told_late(found: Explained) -> str:
    """
    Return a sentence where the command acts more than half a sample period after its row, or ''.

    Loggers write rows in many ways, so that this may be one of them and is no fault by itself. A
    command that truly comes late looks the same, and the twin has to be told of it.
    """
    late = command_late(found)
    if late <= 0.0:
        return ''
    period = min(one.measured.period for one in found.samples.errors)
    return (f'the recordings fit where the command acts {late:.1f} sample periods '
            f'({1e3 * late * period:.3g} ms) after its row, and are simulated so. A logger that '
            'writes the command before it acts does that; otherwise the drive lacks a delay of '
            'that size (command_delay)')


def as_acted(recording: Recording, late: float) -> Recording:
    """
    Return a recording whose command stands in the rows in which it acts.

    It acts ``late`` sample periods after its row and holds until the next, or so much before. In
    a row in which it changes stands its mean.
    """
    if not late or not recording.has('voltage'):
        return recording
    given = recording.columns['voltage']
    rows, whole = np.arange(len(given)), int(np.floor(late))
    share = late - whole
    held, before = (given[np.clip(rows - whole - one, 0, len(given) - 1)] for one in (0, 1))
    return replace(recording, columns={**recording.columns,
                                       'voltage': (1.0 - share) * held + share * before})


def split_as_acted(split: Split, late: float) -> Split:
    """Return all recordings of a diagnosis so, each once."""
    acted = {id(one): as_acted(one, late) for one in (*split.screen, *split.accept, *split.report)}
    screen, accept, report = (tuple(acted[id(one)] for one in some)
                              for some in (split.screen, split.accept, split.report))
    return replace(split, screen=screen, accept=accept, report=report)
