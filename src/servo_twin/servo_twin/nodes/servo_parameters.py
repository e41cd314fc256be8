"""The values of a servo as ROS parameters: path, unit, range and meaning from the declaration."""

from __future__ import annotations

from collections.abc import Iterable

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..lockstep.live_changes import changed
from ..physics.servo import Servo, Value

SOURCE = 'set as a ROS parameter'


def declare(node: Node, servo: Servo, overrides: bool) -> Servo:
    """
    Declare every value of a servo by its path, rows as double arrays.

    With ``overrides``, values given when the node was started come before those of the servo file.
    Returns the servo with the values as they stand. Raises ServoError, and rclpy's
    ParameterException for a value that is given with another type or out of range.
    """
    changes: dict[str, Value] = {}
    for path, declared in servo.declarations():
        value, unit = servo.values[path], servo.unit(path)
        low, high = declared.bounds
        given = f'{declared.meaning} Unit: {unit or "none"}.'
        descriptor = ParameterDescriptor(description=given)
        if isinstance(value, tuple):
            descriptor.additional_constraints = (
                f'{len(value)} numbers, each within [{low:g}, {high:g}]')
        else:
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
        now = node.declare_parameter(path, list(value) if isinstance(value, tuple) else value,
                                     descriptor, ignore_override=not overrides).value
        now = tuple(now) if isinstance(value, tuple) else now
        if now != value:
            changes[path] = now
    return changed(servo, changes, SOURCE) if changes else servo


def withdraw(node: Node, servo: Servo) -> None:
    """Undeclare the values of a servo."""
    for path in servo.values:
        if node.has_parameter(path):
            node.undeclare_parameter(path)


def changes_in(parameters: Iterable[Parameter], servo: Servo) -> dict[str, Value]:
    """Return the values of a servo among ROS parameters that are being set."""
    return {p.name: tuple(p.value) if isinstance(servo.values[p.name], tuple) else p.value
            for p in parameters if p.name in servo.values}
