"""The parameters of the twin node itself, declared once; those of its servo come beside them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..balances.residual_filters import WINDOW
from ..description.shipped import servo_file
from ..lockstep.live_changes import check_mode
from ..lockstep.live_modes import LIVE_MODES
from ..lockstep.lockstep import Settings
from ..physics.servo import Servo, ServoError

SHIPPED = 'rv_bench'
_SETTINGS = ('mode', 'bridge', 'catch', 'balance_window')


def declare(node: Node) -> None:
    """Declare what the node has before it knows its servo."""
    node.declare_parameter('servo_file', SHIPPED, ParameterDescriptor(
        description='Path of the servo file, or the name of a shipped one; read on configure. '
                    'A running twin gets another one by the service twin/load_servo.'))
    node.declare_parameter('mode', 'measured_input', ParameterDescriptor(
        description='How the twin runs: free under the command that the rig received, with its '
                    'own controller under the same reference, or pulled by the measurements.',
        additional_constraints=f'one of {list(LIVE_MODES)}'))
    node.declare_parameter('bridge', 50, ParameterDescriptor(
        description='Missing samples that are stepped over with the last input held; after more '
                    'of them the twin begins again. Unit: samples.',
        integer_range=[IntegerRange(from_value=0, to_value=100_000, step=1)]))
    node.declare_parameter('catch', 0.1, ParameterDescriptor(
        description='How long the twin runs as an observer after it began, so that it takes up '
                    "the rig's speed; acts at the next beginning. Unit: s.",
        floating_point_range=[FloatingPointRange(from_value=0.0, to_value=60.0)]))
    node.declare_parameter('balance_window', WINDOW, ParameterDescriptor(
        description='Length of the filters of the balances; residuals come half of it late. '
                    'Read on configure. Unit: s.',
        floating_point_range=[FloatingPointRange(from_value=0.0, to_value=1.0)]))
    node.declare_parameter('overload', 2.0, ParameterDescriptor(
        description='How far the twin may fall behind the rig and catch up by larger blocks; '
                    'beyond, it begins again at the newest sample and counts what it left out. '
                    'Unit: s.',
        floating_point_range=[FloatingPointRange(from_value=0.1, to_value=60.0)]))
    node.declare_parameter('plot_rate', 50.0, ParameterDescriptor(
        description='How often twin/plot/residual says what departs most, for plotting tools; '
                    '0: never. Unit: Hz.',
        floating_point_range=[FloatingPointRange(from_value=0.0, to_value=1000.0)]))
    node.declare_parameter('autostart', False, ParameterDescriptor(
        description='Configure and activate at once, without a lifecycle manager.',
        read_only=True))


def settings(node: Node) -> Settings:
    """Return how the twin is to run, as the parameters stand."""
    return Settings(*(node.get_parameter(name).value for name in _SETTINGS))


def autostart(node: Node) -> bool:
    """Whether the node configures and activates itself."""
    return node.get_parameter('autostart').value


def servo_path(node: Node) -> Path:
    """Return the path of the servo file; a bare name is that of a shipped one."""
    return servo_file(node.get_parameter('servo_file').value)


def judge(node: Node, parameters: Iterable[Parameter], servo: Servo | None) -> None:
    """Raise ServoError for a change that cannot be now; ``servo`` is None while unconfigured."""
    for parameter in parameters:
        name, value = parameter.name, parameter.value
        if node.has_parameter(name) and value == node.get_parameter(name).value:
            continue  # so that a dump of its parameters can be loaded while it runs
        if name == 'mode':
            check_mode(servo, value)
        if name in ('servo_file', 'balance_window') and servo is not None:
            raise ServoError(f'{name} is read on configure, and the twin is configured; '
                             + ('service twin/load_servo gives it another servo'
                                if name == 'servo_file' else 'clean it up first'))
