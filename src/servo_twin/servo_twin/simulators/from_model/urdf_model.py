"""A joint of a URDF file: its masses by MuJoCo, the rest as the file has it."""

from __future__ import annotations

from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Mapping
from dataclasses import replace
from math import inf
from pathlib import Path
import re
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from ...description.nearest_name import or_what
from ..joint import GRAVITY, Joint, ModelError
from ..mujoco_model import compiled_text
from .mujoco_joint import joint_of
from .urdf_transmission import number_in, reduction_of

_MOVING = ('revolute', 'continuous', 'prismatic')


def joint_of_urdf(path: Path | str, name: str, at: Mapping[str, float] | None = None,
                  gravity: float = GRAVITY) -> tuple[Joint, float | None]:
    """
    Return a joint of a URDF file, and the reduction of its transmission, if any.

    The other joints are held at ``at`` (rad, m), or at zero; the root link stands still, its z
    upwards. Shapes are left aside: a URDF link has the mass of its `inertial` or none. Raises
    ModelError.
    """
    try:
        return _read(path, name, at or {}, gravity)
    except ModelError:
        raise
    except ValueError as problem:
        raise ModelError(f'{path}: has something that is no number: {problem}') from None


def moving_joints(path: Path | str) -> list[str]:
    """Return the joints of a URDF file that a servo may drive; raises ModelError without any."""
    found = [one.get('name', '') for one in _robot(path).findall('joint')
             if one.get('type') in _MOVING and one.find('mimic') is None]
    if not found:
        raise ModelError(f'{path}: no joint in it is {", ".join(_MOVING)}')
    return found


def _read(path: Path | str, name: str, at: Mapping[str, float],
          gravity: float) -> tuple[Joint, float | None]:
    robot = _robot(path)
    joints = {one.get('name', ''): one for one in robot.findall('joint')}
    for each in joints.values():
        if each.find('parent') is None or each.find('child') is None:
            raise ModelError(f'{path}: joint {each.get("name")!r} has no parent or no child')
    one = _chosen(joints, name, path)
    _check_signs(one, path)
    left_out: list[str] = []
    for other, value in at.items():
        if other not in joints:
            raise ModelError(f'--at {other}={value:g}: there is no joint {other!r} in {path}; '
                             f'{or_what(other, joints)}')
    _hold(joints, name, at, left_out)
    _cut(robot, joints, one, path, left_out)
    for beside in robot.findall('mujoco'):
        robot.remove(beside)
    settings = ElementTree.SubElement(robot, 'mujoco')
    # not fused: some versions of MuJoCo (3.3.7) get the inertia of fused links wrong
    ElementTree.SubElement(settings, 'compiler').set('fusestatic', 'false')
    ElementTree.SubElement(settings, 'option').set('gravity', f'0 0 {-gravity!r}')
    model = compiled_text(ElementTree.tostring(robot, 'unicode'), str(path))
    said = Path(path).name
    where = ''.join(f', {other} = {value:g}' for other, value in at.items())
    found = joint_of(model, name, said)
    reduction = reduction_of(robot, name, left_out)
    return _worded(found, one, said, f'zero{where}', gravity, left_out), reduction


def _robot(path: Path | str) -> ElementTree.Element:
    try:
        text = _decoded(Path(path).read_bytes())
    except (OSError, UnicodeDecodeError, LookupError) as problem:
        raise ModelError(f'{path}: cannot be read: {problem}') from None
    bare = re.sub('<!--.*?-->', '', text, flags=re.DOTALL)  # xacro keeps comments
    if 'xacro:' in bare or '${' in bare or str(path).endswith('.xacro'):
        raise ModelError(f'{path}: this is a xacro file; make the URDF of it first: '
                         f'xacro {Path(path).name} > robot.urdf')
    if re.search('<!(DOCTYPE|ENTITY)', text):
        raise ModelError(f'{path}: has a document type or entities; a URDF file has none')
    try:
        robot = ElementTree.fromstring(text)  # noqa: S314  (entities are refused above)
    except ElementTree.ParseError as problem:
        raise ModelError(f'{path}: is not XML: {problem}') from None
    if robot.tag != 'robot':
        raise ModelError(f'{path}: its root is <{robot.tag}>, that of a URDF file is <robot>')
    return robot


def _decoded(raw: bytes) -> str:
    """Return the text of an XML file in the encoding of its byte order mark or its first line."""
    if raw.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        return raw.decode('utf-16')
    declared = re.match(rb"""\s*<\?xml[^>]*\sencoding=["']([\w.-]+)""", raw)
    encoding = declared[1].decode() if declared else 'utf-8'
    return raw.decode('utf-8-sig' if encoding.lower() == 'utf-8' else encoding)


def _chosen(joints: Mapping[str, ElementTree.Element], name: str,
            path: Path | str) -> ElementTree.Element:
    moving = [n for n, one in joints.items() if one.get('type') in _MOVING]
    if name not in joints:
        raise ModelError(f'{path}: there is no joint {name!r}; '
                         f'{or_what(name, moving, "joints that move are")}')
    if name not in moving:
        kind = joints[name].get('type') or 'of no type'
        raise ModelError(f'{path}: joint {name!r} is {kind}; a servo drives ' + (
            f'one of {moving}' if moving else f'one that is {", ".join(_MOVING)}, and there is '
            'none in it'))
    return joints[name]


def _check_signs(one: ElementTree.Element, path: Path | str) -> None:
    """Raise ModelError for damping, friction or a limit below zero, which no joint has."""
    for tag, key in (('dynamics', 'damping'), ('dynamics', 'friction'), ('limit', 'effort'),
                     ('limit', 'velocity')):
        place = one.find(tag)
        if place is not None and number_in(place.get(key, '0')) < 0.0:
            raise ModelError(f'{path}: joint {one.get("name")!r} has a {tag} {key} of '
                             f'{place.get(key)}; it must be 0 or more')


def _cut(robot: ElementTree.Element, joints: Mapping[str, ElementTree.Element],
         one: ElementTree.Element, path: Path | str, left_out: list[str]) -> None:
    """
    Keep of a robot what a joint carries, with its masses, and the chain that it hangs on.

    Links that have a shape and no `inertial` are ``left_out``. Raises ModelError where all are.
    """
    ends = {name: (each.find('parent').get('link', ''), each.find('child').get('link', ''))
            for name, each in joints.items()}
    above, carried = (_linked(pairs, {start}) for pairs, start in (
        ([(child, parent) for parent, child in ends.values()], one.find('parent').get('link', '')),
        (list(ends.values()), one.find('child').get('link', ''))))
    for name, each in joints.items():
        if each is not one and not (set(ends[name]) <= above or set(ends[name]) <= carried):
            robot.remove(each)
    bare: list[str] = []
    for link in robot.findall('link'):
        name = link.get('name', '')
        if name not in above | carried:
            robot.remove(link)
        if name in carried and link.find('inertial') is None:
            bare.append(name)
            if link.find('visual') is not None or link.find('collision') is not None:
                left_out.append(f'the mass of link {name!r}, which has a shape and no inertial')
        unneeded = ('visual', 'collision', *(() if name in carried else ('inertial',)))
        for part in [each for each in link if each.tag in unneeded]:
            link.remove(part)
        mass = link.find('inertial/mass')
        if mass is not None and not float(mass.get('value', 'nan')) >= 0.0:
            raise ModelError(f'link {name!r} has a mass of {mass.get("value")} kg')
    if carried <= set(bare):
        raise ModelError(f'{path}: joint {one.get("name")!r} carries no mass: none of the links '
                         f'{sorted(carried)} has an inertial; add it, as a CAD program gives it')


def _linked(pairs: list[tuple[str, str]], found: set[str]) -> set[str]:
    """Return what can be reached from some links by pairs of (from, to)."""
    more = {to for start, to in pairs if start in found} - found
    return _linked(pairs, found | more) if more else found


def _hold(joints: Mapping[str, ElementTree.Element], name: str, at: Mapping[str, float],
          left_out: list[str]) -> None:
    """Fix all joints but one at their positions, so that it carries one rigid body."""
    for other, one in joints.items():
        mimic = one.find('mimic')
        if mimic is not None and other == name:
            left_out.append(f'that it mimics joint {mimic.get("joint")!r}')
        elif mimic is not None and mimic.get('joint') == name:
            left_out.append(f'joint {other!r}, which mimics it, and what that carries')
        if mimic is not None:
            one.remove(mimic)
        if other == name or one.get('type') == 'fixed':
            continue
        if at.get(other):
            if one.get('type') not in _MOVING:
                raise ModelError(f'--at {other}={at[other]:g}: joint {other!r} is '
                                 f'{one.get("type")}; only {_MOVING} can be set')
            _displace(one, at[other])
        one.set('type', 'fixed')


def _displace(one: ElementTree.Element, value: float) -> None:
    """Move the origin of a joint as its motion by ``value`` (rad, m) would."""
    origin, axis = one.find('origin'), one.find('axis')
    if origin is None:
        origin = ElementTree.SubElement(one, 'origin')
    place = np.array([float(v) for v in origin.get('xyz', '0 0 0').split()])
    turn = Rotation.from_euler('xyz', [float(v) for v in origin.get('rpy', '0 0 0').split()])
    way = np.array([float(v) for v in (
        '1 0 0' if axis is None else axis.get('xyz', '1 0 0')).split()])
    way = way / np.linalg.norm(way)
    if one.get('type') == 'prismatic':
        place = place + turn.apply(way * value)
    else:
        turn = turn * Rotation.from_rotvec(way * value)
    origin.set('xyz', ' '.join(repr(float(v)) for v in place))
    origin.set('rpy', ' '.join(repr(float(v)) for v in turn.as_euler('xyz')))


def _worded(found: Joint, one: ElementTree.Element, said: str, where: str, gravity: float,
            left_out: list[str]) -> Joint:
    """Return a joint whose sources are named as a URDF file names them."""
    carried = f'{said}: inertials that joint {found.name!r} carries, the rest held at {where}'
    sources = {
        'inertia': carried, 'armature': 'URDF holds no armature; --armature gives it',
        'damping': f'{said}: joint {found.name!r}, dynamics damping',
        'friction': f'{said}: joint {found.name!r}, dynamics friction',
        'torque_limit': f'{said}: joint {found.name!r}, limit effort',
        'cosine': f'{carried}; gravity {gravity:g} m/s2 along -z of the root link',
    }
    sources['sine'] = sources['cosine']
    ends = [each for each in found.left_out if each.startswith('end stops')]
    limit = one.find('limit')
    if limit is not None:
        speed = number_in(limit.get('velocity', 'inf'))
        effort = number_in(limit.get('effort', 'inf'))
        if 0.0 < speed < inf:
            ends.append(f'its speed limit, {speed:g} {found.unit("rad")}/s')
        zero = [name for name, value in (('effort', effort), ('velocity', speed)) if value == 0.0]
        if zero:  # as exporters of CAD write them
            where = ' (drive.current_limit in the servo file holds one)' if not effort else ''
            ends.append(f'a limit of its {" and ".join(zero)}: 0 in the file, where it could not '
                        f'move; taken for one that nobody gave{where}')
    for extra in ('safety_controller', 'calibration'):
        if one.find(extra) is not None:
            ends.append(f'its {extra}')
    return replace(found, sources={name: text for name, text in sources.items()
                                   if name in found.sources},
                   left_out=(*left_out, *ends))
