"""The transmission of a joint in a URDF file, as ROS 1 and ros2_control write it."""

from __future__ import annotations

from math import inf, nan
from xml.etree import ElementTree

from ..joint import ModelError

_REDUCTIONS = ('mechanicalReduction', 'mechanical_reduction')  # of ROS 1, and of ros2_control


def reduction_of(robot: ElementTree.Element, name: str, left_out: list[str]) -> float | None:
    """
    Return the size of the reduction of a joint's transmission; None where there is none.

    A direction, an offset and a transmission of several joints are ``left_out``. Raises ModelError
    for a reduction that is no number or zero, and for several that differ.
    """
    found: dict[str, float] = {}
    for transmission in robot.findall('.//transmission'):
        joints, called = transmission.findall('joint'), transmission.get('name')
        if name not in [one.get('name') for one in joints]:
            continue
        if len(joints) > 1:
            left_out.append(f'transmission {called!r}, which couples joints '
                            f'{[one.get("name") for one in joints]}')
            continue
        for place in (*joints, *transmission.findall('actuator')):
            for one in [each for each in place if each.tag in _REDUCTIONS]:
                found[f'{number_in(one.text):g} of {place.tag} {place.get("name")!r} in '
                      f'{called!r}'] = _reduction(one, name, called)
            offset = number_in(place.findtext('offset', '0'))
            if offset:
                left_out.append(f'the offset of transmission {called!r}, {offset:g}: motor and '
                                'joint are zero at other places; set it right in the mapping')
    if len({abs(one) for one in found.values()}) > 1:
        raise ModelError(f'joint {name!r} has several reductions, {", ".join(found)}: leave one '
                         'in the file, the turns of the motor for one of the joint')
    for value in set(found.values()):
        if value < 0.0:
            left_out.append(f'that the motor turns against the joint (mechanicalReduction '
                            f'{value:g}); turn the sign of motor_position in the mapping')
    return next((abs(one) for one in found.values()), None)


def _reduction(one: ElementTree.Element, name: str, called: str | None) -> float:
    value = number_in(one.text)
    if not 0.0 < abs(value) < inf:
        raise ModelError(
            f'transmission {called!r} of joint {name!r} has a {one.tag} of '
            f'{(one.text or "").strip()!r}; write turns of the motor for one of the joint, such '
            'as 50, or leave it out and give --ratio')
    return value


def number_in(text: str | None) -> float:
    """Return the number that a text holds, NaN where it holds none."""
    try:
        return float(text or '')
    except ValueError:
        return nan
