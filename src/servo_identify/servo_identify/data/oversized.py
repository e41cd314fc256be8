"""Volts and amperes that no servo has: numbers in thousandths, all of which fit together."""

from __future__ import annotations

from collections.abc import Iterator

from servo_twin.physics.servo import Servo

from .column_units import takes_current
from .finding import Finding
from .survey import Survey

LARGEST = {'V': 2000.0, 'A': 5000.0}
"""What no drive of a servo has."""


def size_findings(one: Survey, servo: Servo) -> Iterator[Finding]:
    """Yield which of command and current are larger than those of any servo."""
    command = 'A' if takes_current(servo) else 'V'
    for name, unit, ends in (('voltage', command, one.command), ('current', 'A', one.current)):
        size, most = max(map(abs, ends)), LARGEST[unit]
        if name in one.measured and size > most:
            yield Finding('amber', f'{one.name}: {name} reaches {size:.4g} {unit}, and no servo '
                          f'has more than {most:g} {unit}: is it in m{unit}?',
                          f'give the unit in the header or the mapping: {name} [m{unit}]')
