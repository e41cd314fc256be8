"""One call of a command for several joints of a robot: a servo file of each in a folder."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import sys

from ..description.joint_names import ALL, are_several, file_names, names_in, value_of
from ..simulators.joint import ModelError
from .terminal import tell

PER_JOINT = ('ratio', 'torque_constant', 'kp', 'kd', 'torque_limit', 'armature', 'resistance')
"""Flags of which each joint may have its own: --ratio 50 --ratio knee=9."""


def for_each(arguments: argparse.Namespace, known: Callable[[], Sequence[str]],
             write: Callable[[argparse.Namespace], int]) -> int:
    """
    Write the servo file of each joint that --joint names; 1 where one of several cannot be.

    ``known`` returns all joints that a servo may drive. Of several, -o is a folder. Raises
    ModelError for flags that cannot be, and for one joint what ``write`` raises.
    """
    names = names_in(arguments.joint)
    if not are_several(arguments.joint):
        return write(_of(arguments, names[0] if names else '', names))
    if arguments.output.suffix in ('.yaml', '.yml') or arguments.output.is_file():
        raise ModelError(f'of several joints -o is a folder, not {arguments.output}, into which '
                         'the servo file of each is written')
    names = [*known()] if names == [ALL] else names
    files, found, left = file_names(names), dict[str, object](), list[str]()
    for joint in names:
        one = _of(arguments, joint, names)
        one.output = arguments.output / f'{files[joint]}.yaml'
        one.name = f'{arguments.name}_{files[joint]}' if arguments.name else None
        one.at = [pair for pair in arguments.at if pair.partition('=')[0] != joint]
        try:
            write(one)
        except ModelError as problem:
            print(f'{joint} is left out: {problem}', file=sys.stderr)
            left.append(joint)
        else:
            found[joint] = one.found
    written = [arguments.output / f'{files[joint]}.yaml' for joint in found]
    tell(arguments, joints=found, left_out=left, written=written)
    return int(bool(left))


def _of(arguments: argparse.Namespace, joint: str, joints: Sequence[str]) -> argparse.Namespace:
    """Return the arguments of one joint, with its own values as numbers."""
    one = argparse.Namespace(**vars(arguments)) if len(joints) != 1 else arguments
    one.joint, one.found = joint, {}
    for name in PER_JOINT:
        texts = getattr(arguments, name, None)
        if texts is None:
            continue
        flag = f'--{name.replace("_", "-")}'
        try:
            text = value_of(flag, texts, joint, joints)
            setattr(one, name, None if text is None else float(text))
        except ValueError as problem:
            said = str(problem)
            raise ModelError(said if said.startswith('--') else
                             f'{flag} {text!r}: it must be a number') from None
    return one
