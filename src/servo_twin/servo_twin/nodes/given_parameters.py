"""What a node was told at its start that cannot be, in words; the rig has its own."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from itertools import pairwise
from pathlib import Path
import re
import sys
from typing import Any

import rclpy
from rclpy.exceptions import InvalidParameterTypeException, ParameterException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.node import Node
import yaml

from ..description.nearest_name import or_what

EVERYWHERE = {'/rosout': 'rcl_interfaces/msg/Log',
              '/parameter_events': 'rcl_interfaces/msg/ParameterEvent',
              '/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray'}
"""The topics of every node, and their types."""
_OWN = [f'~/{name}' for name in (
    'describe_parameters', 'get_parameters', 'get_parameter_types', 'list_parameters',
    'set_parameters', 'set_parameters_atomically', 'get_type_description', 'change_state',
    'get_state', 'get_available_states', 'get_available_transitions', 'get_transition_graph',
    'transition_event')]
"""What ROS gives every node, or every lifecycle node."""
_REMAP = re.compile(r'(?:(\w+):(?!//|=))?(?:ros(?:topic|service)://)?(.*?):=')
"""A rule: the node that it is for, if it says so, and the name that it changes."""
LATER = 'qos_overrides.'
"""Begins the names that a node declares with its publishers and subscriptions."""


class UnknownParameter(ValueError):
    """A parameter was given at the start that the node does not have."""


class SharedName(ValueError):
    """Two topics of different types, or two services, were given one name at the start."""


UNFIT = ParameterException, UnknownParameter, SharedName
"""What a node that was told something wrong raises as it is made."""
_TYPES = {'INTEGER': 'an integer', 'DOUBLE': 'a number with a point', 'STRING': 'a text',
          'BOOL': 'true or false'}


def in_words(problem: Exception) -> str:
    """Return what is wrong as a sentence: rclpy names types as its source does."""
    found = re.match(r"Trying to set parameter '(.+)' to '(.*)' of type '(\w+)', expecting type "
                     r"'(\w+)'", str(problem))
    if not isinstance(problem, InvalidParameterTypeException) or found is None:
        return str(problem)
    name, value, given, wanted = found.groups()
    write = {('INTEGER', 'DOUBLE'): f': write {value}.0', ('INTEGER', 'STRING'): (
        f': write "{name}:=\'{value}\'"')}.get((given, wanted), '')
    return (f'{name} = {value} is {_TYPES.get(given, given)}, and it must be '
            f'{_TYPES.get(wanted, wanted)}{write}')


def cannot_start(who: str, problem: Exception) -> int:
    """Say why a node cannot start, end ROS, and return the status of the process."""
    print(f'{who}: {in_words(problem)}', file=sys.stderr)
    rclpy.try_shutdown()
    return 2


def refuse_unknown(node: Node) -> None:
    """
    Raise UnknownParameter for what was given at the start and is not declared by now.

    So it is of a file whose parts are all of nodes of this name in other namespaces: ROS would
    leave the file out, and the node would run with values that nobody chose.

    A node cannot see who a value was meant for: ``-p`` and a launch file reach it as ``/**`` of a
    file does. A file for several nodes therefore gives each its own part, as ``/**/twin:``.
    """
    declared = sorted(node._parameters)
    for name in sorted(node._parameter_overrides):
        if name not in declared and not name.startswith(LATER):
            raise UnknownParameter(
                f'{node.get_name()} has no parameter {name!r}, which was given at its start; '
                f'{or_what(name, declared)}. In a file for several nodes, write it below the '
                'node that has it')
    name = node.get_fully_qualified_name()
    for file in (after for word, after in pairwise(sys.argv) if word == '--params-file'):
        parts = list(_parts_of(yaml.safe_load(Path(file).read_text('utf8'))))
        own = [part for part in parts if part.rpartition('/')[2] == node.get_name()]
        if own and not any(_fits(part, name) for part in parts):
            raise UnknownParameter(f'{file} is of {own}, and this node is {name}: none of its '
                                   f'values would be taken; write /**/{node.get_name()} there')


def judge_remaps(node: Node, topics: Mapping[str, type | str],
                 services: Mapping[str, type] | None = None, actions: Collection[str] = ()
                 ) -> None:
    """
    Raise SharedName where remaps give topics of two types, or two services, one name.

    ``topics`` and ``services`` are all that the process has, types by the names before remaps, and
    ``actions`` its actions. A remap of a name that is none of these changes nothing: the log says
    so.
    """
    services = services or {}
    _tell_idle(node, [*topics, *services, *actions], actions)
    own = {one.service_name: one.srv_type for one in node.services}
    for what, resolved, types in (
            ('topic', node.resolve_topic_name, {**EVERYWHERE, **topics}),
            ('service', node.resolve_service_name, {**own, **services})):
        taken: dict[str, tuple[str, str]] = {}
        for name, kind in types.items():
            text = kind if isinstance(kind, str) else '/'.join(
                [*kind.__module__.split('.')[:2], kind.__name__])
            other, of_other = taken.setdefault(resolved(name), (name, text))
            if other != name and (what == 'service' or of_other != text):
                raise SharedName(f'{other} ({of_other}) and {name} ({text}) would both be the '
                                 f'{what} {resolved(name)}; change the remaps (-r {name}:=...) so '
                                 'that each has a name of its own')


def _tell_idle(node: Node, names: Collection[str], actions: Collection[str]) -> None:
    """Warn of each remap of the command line whose name is none of those that the node has."""
    def whole(name: str) -> str:
        return expand_topic_name(name, node.get_name(), node.get_namespace())

    known = {whole(name) for name in (*names, *EVERYWHERE, '/clock', *_OWN)}
    parts = tuple(f'{whole(action)}/_action/' for action in actions)
    for rule in dict.fromkeys(_remaps()):
        of, source = _REMAP.match(rule).groups()
        if (of in (None, node.get_name()) and not source.startswith('__')
                and whole(source) not in known and not whole(source).startswith(parts)):
            node.get_logger().warning(
                f'the remap {rule} changes nothing: {node.get_name()} has no topic, service or '
                f'action {source!r}; {or_what(source, names, "it has")}')


def _remaps() -> Iterator[str]:
    """Return the rules of the command line that remap names."""
    ours = False
    for word, after in pairwise([*sys.argv, '']):
        ours = word == '--ros-args' or ours and word != '--'
        if ours and word in ('-r', '--remap'):
            yield after


def _parts_of(file: Any, above: str = '') -> Iterator[str]:
    """Return the names of nodes, which may hold * and **, that a parameter file is of."""
    for key, inner in file.items() if isinstance(file, dict) else ():
        if key == 'ros__parameters':
            yield above
        else:
            yield from _parts_of(inner, f'{above}/{str(key).strip("/")}')


def _fits(part: str, name: str) -> bool:
    """Tell whether a part of a parameter file is for a node of a full name."""
    tokens = {'**': '(/[^/]+)*', '*': '/[^/]+'}
    return re.fullmatch(''.join(tokens.get(token, '/' + re.escape(token))
                                for token in part.strip('/').split('/')), name) is not None
