"""What of a file becomes no column of a recording, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import re

from ..data.column_names import ANGLE, looks_like, TOLD_TORQUE, TORQUE
from .hints import doubt_of
from .proposals import Proposal
from .sources import Offered

_TORQUES = {
    TORQUE: 'tells nothing beside the current that it was computed from; '
            "--column 'torque={}:UNIT' where a sensor measured it",
    TOLD_TORQUE: 'is a torque that was told; '
                 "--column 'voltage={}:UNIT' where it is what the drive received"}


_SHAFTS = ('motor_position', 'load_position')


def left_out(of: Offered, chosen: Mapping[str, Proposal], joint: str) -> list[str]:
    """Return the sources that are no column, of messages those of the same joint."""
    taken = {one.source for one in chosen.values()}
    joints = {f'[{joint}]'} if joint else {
        name for source in taken for name in re.findall(r'\[[^\[\]]+\]$', source)}
    beside = [one for one in of.sources if any(name in one for name in joints)]
    return [source for source in (beside if of.messages else (*of.sources, *of.refused))
            if source not in taken]


def reasons(of: Offered, left: Sequence[str]) -> list[str]:
    """Return why columns that were left out cannot be read, where their names are needed."""
    return [said for name, said in of.refused.items() if name in left and looks_like(name)]


def other_angles(proposals: Mapping[str, Sequence[Proposal]], chosen: Mapping[str, Proposal],
                 left: Sequence[str]) -> list[str]:
    """Return which angles may be that of the other shaft, where one shaft has its own."""
    shafts = [one for one in _SHAFTS if one not in chosen]
    if len(shafts) != 1:
        return []
    shaft = shafts[0].partition('_')[0]
    return [f"{one.source!r} is an angle as well: --column '{shaft}_position={one.source}"
            f"{'' if one.unit else ':UNIT'}' where it is that of the {shaft}"
            + (f' ({doubt})' if (doubt := doubt_of(one.column, one.source)) else '')
            for one in proposals.get(ANGLE, ()) if one.source in left]


def remarks(proposals: Mapping[str, Sequence[Proposal]], chosen: Mapping[str, Proposal],
            left: Sequence[str]) -> list[str]:
    """Return what is said of what was left out and may be needed: torques, the command."""
    said = [f'{one.source!r} {told.format(one.source)}' for kind, told in _TORQUES.items()
            for one in proposals.get(kind, ()) if one.source in left]
    said += other_angles(proposals, chosen, left)
    set_point = chosen.get('current_reference')
    if set_point and 'voltage' not in chosen:
        said.append(f'there is no command; {set_point.source!r} is the set-point of the current: '
                    f"--column 'voltage={set_point.source}:{set_point.unit or 'A'}' where it is "
                    'what the drive received')
    return said
