"""Which joint of several is meant: by a flag, by the columns that are given, or by a question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from servo_twin.description.nearest_name import or_what

from .joints import given_joint, joint_in, joints_of
from .proposals import Proposal
from .questions import Ask, one_of
from .sources import Offered


def choose_joint(of: Offered, proposals: Mapping[str, Sequence[Proposal]],
                 given: Mapping[str, Proposal], wanted: str, ask: Ask | None
                 ) -> tuple[str, list[str]]:
    """
    Return the joint to look at where a file has several, and the flag that chooses it.

    Raises ValueError for a ``wanted`` one that the file has not.
    """
    joints = joints_in(of, proposals)
    if wanted:
        known = {joint_in(one, of.messages, joints)[1] for one in of.sources} - {''}
        if wanted not in known and not any(f'/{wanted}/' in one for one in of.sources):
            raise ValueError(f'--joint {wanted}: {of.path} has no such joint; '
                             f'{or_what(wanted, joints or sorted(known), "it has")}')
        return wanted, []
    told = given_joint((one.source for one in given.values()), joints, of.messages)
    if not joints or told:
        return told, []
    if ask:
        return one_of(ask, 'Which joint', joints), []
    return joints[0], [f'--joint NAME (of {joints}; what follows is for {joints[0]!r}), '
                       'or --joint all, which writes the files of each into the folder -o']


def joints_in(of: Offered, proposals: Mapping[str, Sequence[Proposal]]) -> list[str]:
    """Return the joints of a file, [] where it has one or none of them is named."""
    return joints_of(([one.source for one in several] for several in proposals.values()),
                     of.messages)
