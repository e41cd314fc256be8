"""What a person says of how far a rig may go in the next experiment."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

from servo_twin.description.nearest_name import or_what

REACH = {'travel': 'rad', 'speed': 'rad/s', 'torque': 'N m', 'amplitude': 'V'}


def check_reach(reach: Mapping[str, float]) -> None:
    """Raise ValueError for a limit without a name of :data:`REACH`, and for one not above 0."""
    for name, value in reach.items():
        if name not in REACH:
            raise ValueError(f'there is no reach {name!r}; {or_what(name, REACH)}')
        if not 0.0 < value < inf:
            raise ValueError(f'reach: {name} = {value:g} {REACH[name]}, it must be above 0 and '
                             'finite')
