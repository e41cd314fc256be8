"""Several joints of one recording, each a machine of its own, and the jobs of all of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from os.path import relpath
from pathlib import Path
import re

import yaml

from servo_twin.description.joint_names import ALL, file_names, names_in, value_of

from .joint_choice import choose_joint, joints_in
from .joints import joint_in
from .next_step import alike
from .one_machine import Draft, Made, Wanted
from .proposals import proposed
from .sources import Offered

PLACE = '{joint}'
"""What stands for the name of the joint in a --column."""
JOBS = 'rigs.yaml'
"""The file that `servo-identify diagnose --jobs` takes."""


def wanted_joints(of: Offered, flags: Sequence[str]) -> list[str]:
    """Return the joints that are asked for; raises ValueError for one that there is not."""
    names = names_in(flags)
    proposals = proposed(of)
    if names == [ALL]:
        names = joints_in(of, proposals)
        if not names:
            raise ValueError(f'--joint all: nothing in {of.path} tells several joints apart: its '
                             f'columns are {list(of.sources)}; leave --joint out for one machine, '
                             'or name the joint and its columns')
    for name in names:
        choose_joint(of, proposals, {}, name, None)
    return names


def of_joint(common: Wanted, joint: str, joints: Sequence[str],
             values: Mapping[str, Sequence[str]]) -> Wanted:
    """
    Return what is asked for of one joint.

    ``common`` is that of all, with the folder as its output. A value is for all joints, or behind
    ``elbow=`` for one; of several for one joint the last counts. In a source {joint} stands for
    its name. Raises ValueError for a value of a joint that is not among them.
    """
    own = {name: text for name, texts in values.items()
           if (text := value_of(f'--{name.replace("_", "-")}', texts, joint, joints))
           is not None}
    name = file_names(joints)[joint]
    return replace(common, name=f'{common.name}_{name}' if common.name else name, joint=joint,
                   output=common.output / f'{name}.yaml', values=own,
                   columns=tuple(one.replace(PLACE, joint) for one in common.columns))


def missing_of_all(drafts: Iterable[Draft]) -> list[str]:
    """
    Return the flags that joints lack, each once.

    A flag that names the column of a joint says {joint} in its place, which `init` takes so. One
    that some joints lack alone says which.
    """
    several = [draft for draft in drafts]
    lacking: dict[str, list[str]] = {}
    for draft in several:
        joint = draft.wanted.joint
        for one in draft.missing:
            lacking.setdefault(_for_any(one, draft), []).append(joint)
    found = []
    for said, joints in lacking.items():
        some = '' if len(joints) == len(several) else f' (of {", ".join(joints)})'
        one = said if len(joints) > 1 else said.replace(PLACE, joints[0])
        found.append(one + some)
    if not found:
        return []
    remarks = dict.fromkeys(_for_any(one, draft) for draft in several for one in draft.remarks)
    places = any(PLACE in one for one in found)
    first = several[0].wanted.joint
    return [*found, *([f'{PLACE} stays as it is: it stands for the name of each joint'] * places),
            f"a value is for all joints, or of one: --ratio 50 --ratio '{first}=100'", *remarks]


def _for_any(text: str, draft: Draft) -> str:
    """Return a text in which {joint} stands in the sources that have the name of the joint."""
    for source in draft.of.sources:
        shape = _shape_of(source, draft.wanted.joint, draft.of.messages)
        if shape != source:
            text = re.sub(rf"(?<=[=']){re.escape(source)}(?=[':\s]|$)", lambda _, to=shape: to,
                          text)
    return text


def _shape_of(source: str, joint: str, messages: bool) -> str:
    """Return a source with {joint} where it has the name of the joint, in topic and index."""
    (before, _), named = joint_in(source, messages, (joint,))
    if named == joint:
        at = source.index(joint, len(before))
        source = source[:at] + PLACE + source[at + len(joint):]
    return source.replace(f'/{joint}/', f'/{PLACE}/') if messages else source


def jobs_text(folder: Path, made: Sequence[Made]) -> str:
    """Return the file for `diagnose --jobs`: servo file, mapping and recordings of each joint."""
    entries = {}
    for one in made:
        wanted = one.draft.wanted
        entries[wanted.output.stem] = {
            'servo': wanted.output.name,
            **({'mapping': wanted.beside.name} if one.mapping else {}),
            'bags': [relpath(alike(one.draft.of.path), folder)]}
    return ('# Machines for `servo-identify diagnose --jobs`; `servo-identify init` wrote it.\n'
            '# Paths are relative to this file.\n' + yaml.safe_dump(entries, sort_keys=False,
                                                            allow_unicode=True))

