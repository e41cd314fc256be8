"""The parameters of the identify node, declared once."""

from __future__ import annotations

from pathlib import Path

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.node import Node

from servo_twin.commands.terminal import new_folder
from servo_twin.description.home_path import at_home

_REALS = {
    'buffer': (180.0, 's', 2.0, 3600.0, 'How much of the running rig is kept for jobs without '
               'bags; read at the start'),
    'trial': (60.0, 's', 1.0, 3600.0, 'How long a new servo file runs before it is judged against '
              'the old one'),
    'margin': (0.02, '', 0.0, 10.0, 'How much larger, as a share, the residual of a new servo '
               'file may be and yet stay'),
    'watch.block': (0.25, 's', 0.02, 10.0, 'Length of the blocks of the change detector; read '
                    'at the start'),
    'watch.learn': (60.0, 's', 1.0, 3600.0, 'How long the change detector learns what is usual; '
                    'read at the start'),
    'watch.false_alarms': (0.1, '1/h', 1e-6, 1e3, 'False alarms an hour of all balances '
                           'together, at most; read at the start'),
    'online.time_constant': (60.0, 's', 1.0, 1e5, 'In which the online estimator forgets, while '
                             'the rig says something about a quantity'),
    'online.period': (1.0, 's', 0.1, 60.0, 'From one estimate to the next; read at the start'),
}
_AT_START = 'read at the start'
"""What is said so is read once, and refuses to be set on a running node."""

_SWITCHES = {'watch.on': 'Watch the residuals of the twin for changes',
             'online.on': 'Track slowly varying quantities and publish twin/estimate'}


def declare(node: Node) -> None:
    """Declare all of them."""
    node.declare_parameter('servo_file', 'rv_bench', ParameterDescriptor(
        description='Servo file that the twin begins with: a path, or the name of a shipped one; '
                    'afterwards the node follows what the twin says that it runs', read_only=True))
    node.declare_parameter('twin', 'twin', ParameterDescriptor(
        description='Name of the twin node that is followed: in the namespace of this node, or '
                    'whole, as /rig/twin', read_only=True))
    node.declare_parameter('folder', '', ParameterDescriptor(
        description='Where retrained servo files go; empty: a folder that ends with the node',
        read_only=True))
    for name, (default, unit, low, high, text) in _REALS.items():
        node.declare_parameter(name, default, ParameterDescriptor(
            description=f'{text}. Unit: {unit or "none"}.', read_only=_AT_START in text,
            floating_point_range=[FloatingPointRange(from_value=low, to_value=high)]))
    for name, text in _SWITCHES.items():
        node.declare_parameter(name, True, ParameterDescriptor(description=f'{text}.'))


def value(node: Node, name: str):
    """Return the value of a parameter."""
    return node.get_parameter(name).value


def folder(node: Node, scratch: Path) -> Path:
    """
    Return where jobs write, made: the parameter `folder`, or ``scratch`` where it is empty.

    Raises ValueError where nothing can be written there: a retraining would hear of it last.
    """
    given = value(node, 'folder')
    try:
        return new_folder(at_home(given), force=True) if given else scratch
    except ValueError as problem:
        raise ValueError(f'folder = {given!r} is where retrained servo files go: {problem}, or '
                         'leave the parameter out for a folder that ends with the node') from None
