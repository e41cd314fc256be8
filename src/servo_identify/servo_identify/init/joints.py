"""
Which joint of several a recording is to be read of.

Robots log all joints side by side: ``q[3]``, ``actual_q_3``, ``/joint_states.position[elbow]``,
``observation.state[elbow_flex.pos]``, ``left_knee_pos``. One joint is one machine.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
import re

from ..data.column_names import ANGLE, looks_like, split

_INDEXED = re.compile(r'(.*?)\[([^\[\]]+)\](.*)')
_NUMBERED = re.compile(r'(.*[A-Za-z]_?)(\d+)(\D*)')
_ANGLES = (ANGLE, 'motor_position', 'load_position')
_PHASES = ({'a', 'b', 'c'}, {'u', 'v', 'w'}, {'d', 'q'}, {'alpha', 'beta'})
"""Letters of what one motor has of several: its windings, and what they are transformed to."""
_OF_ONE = {'raw', 'filt', 'filtered', 'unfiltered', 'smooth', 'smoothed', 'lp', 'meas', 'measured',
           'est', 'estimated', 'sim', 'simulated', 'model', 'motor', 'rotor', 'load', 'output',
           'input', 'link', 'min', 'max', 'mean', 'actual', 'act'}
"""Words for several readings of one joint, and for its two shafts."""


def are_phases(names: Sequence[str]) -> bool:
    """Tell whether names are those of the phases of one motor, and of no three joints."""
    return len(names) > 1 and any({one.lower() for one in names} <= phases for phases in _PHASES)


def joint_in(source: str, messages: bool, known: Sequence[str] = ()
             ) -> tuple[tuple[str, str], str]:
    """
    Return what stands around the joint in the name of a source, and the joint; '' for none.

    Of the joints that are ``known`` by their words the longest that the name holds is taken.
    """
    name = source if messages else split(source)[0]
    match = _INDEXED.fullmatch(name) or (None if messages else _NUMBERED.fullmatch(name))
    if match and (not known or match[2] in known):
        return (match[1], match[3]), match[2]
    for joint in sorted(known, key=len, reverse=True):
        held = re.fullmatch(rf'(|.*[\W_]){re.escape(joint)}([\W_].*|)', name)
        if held and not messages:
            return (held[1], held[2]), joint
    return ((match[1], match[3]), match[2]) if match else ((name, ''), '')


def joints_of(several: Iterable[Sequence[str]], messages: bool) -> list[str]:
    """
    Return the joints by which sources differ where nothing else tells them apart, else [].

    ``several`` are the sources that may be one column, for each column. A name in brackets is
    that of a joint. A number is one where two columns have the same numbers, and so are words.
    """
    several = [*several]
    found = Counter[tuple[str, ...]]()
    for sources in several:
        parted = [joint_in(one, messages) for one in sources]
        joints = tuple(joint for _, joint in parted)
        if len(joints) > 1 and all(joints) and len({around for around, _ in parted}) == 1:
            found[joints] += 1
    return next((list(joints) for joints, count in found.items()
                 if count > 1 or not all(map(str.isdigit, joints))),
                [] if messages else _by_words(several))


def _by_words(several: Iterable[Sequence[str]]) -> list[str]:
    """Return the joints of ``left_knee_pos``, ``left_hip_pos``: knee and hip in two columns."""
    found, turning = Counter[tuple[str, ...]](), list[tuple[str, ...]]()
    for sources in filter(None, several):
        parted = [re.split(r'(?<=[\W_])|(?=[\W_])', split(one)[0]) for one in sources]
        shortest = min(map(len, parted))
        before, behind = ''.join(_alike(parted, shortest)), ''.join(_alike(
            [one[::-1] for one in parted], shortest)[::-1])
        joints = tuple(''.join(one)[len(before):len(''.join(one)) - len(behind)]
                       for one in parted)
        if len(joints) > 1 and all(joints) and (before or behind):
            found[joints] += 1
            turning += [joints] * (looks_like(sources[0]) in _ANGLES)
    return next((list(joints) for joints, count in found.items() if count > 1 and (
        joints in turning or not are_phases(joints)) and not {*map(str.lower, joints)} <= _OF_ONE),
        [])


def _alike(parted: Sequence[Sequence[str]], shortest: int) -> list[str]:
    """Return the parts with which all begin; one part at least is left of each."""
    found = list[str]()
    for parts in list(zip(*parted, strict=False))[:shortest - 1]:
        if len(set(parts)) > 1:
            break
        found.append(parts[0])
    return found


def of_joint(sources: Sequence[str], joint: str, messages: bool, known: Sequence[str] = ()
             ) -> list[str]:
    """
    Return the sources without those that are the same of another joint; all for ''.

    ``known`` are the joints that :func:`joints_of` found.
    """
    if not joint:
        return list(sources)
    parted = {one: joint_in(one, messages, known) for one in sources}
    around = {shape for shape, named in parted.values() if named == joint}
    # the name of a topic may hold the joint as well
    shapes = [re.escape(one.replace(joint, '*')).replace(r'\*', '[^/]+') for one in sources
              if f'/{joint}/' in one]
    return [one for one, (shape, named) in parted.items() if named == joint
            or f'/{joint}/' in one or not (named and shape in around or any(
                re.fullmatch(other, one) for other in shapes))]


def given_joint(sources: Iterable[str], joints: Sequence[str], messages: bool) -> str:
    """Return the one of the joints that sources are of, '' where they are of several or none."""
    found = {joint_in(one, messages, joints)[1] for one in sources} & {*joints}
    return found.pop() if len(found) == 1 else ''
