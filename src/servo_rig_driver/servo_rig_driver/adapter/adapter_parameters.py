"""The adapter's parameters: each declared here once, with default, unit, range and meaning."""

from __future__ import annotations

from dataclasses import dataclass

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from ..driver.driver_parameters import Declared
from ..driver.encoder_leaps import FASTEST, MEANING

DECLARED = (
    Declared('mapping', '', '', 'Mapping file that says which field of which topic is which '
             'column, as `servo-identify import` takes it; a path, or the name of a shipped one: '
             'joint_state, ros2_control'),
    Declared('joint', '', '', 'Name of the joint, which stands where the mapping says [joint]'),
    Declared('rate', 0.0, 'Hz', "Samples a second; 0: by the mapping's period, else that of the "
             'topic that the mapping takes its time from, measured at the start', 0.0, 20_000.0),
    Declared('listen_time', 1.0, 's', 'How long to listen at the start, for the rate of the '
             'messages and the offset of their clock', 0.1, 30.0),
    Declared('delay', 0.005, 's', 'How long a sample waits at most for the other topics',
             0.0, 1.0),
    Declared('block_size', 10, 'samples', 'Samples that travel in one message', 1, 4096),
    Declared('silence', 0.5, 's', 'A topic not heard for so long is told as silent', 0.02, 60.0),
    Declared('largest_acceleration', FASTEST, 'rad/s^2', MEANING, 1.0, 1e7),
    Declared('history', 2.0, 's', 'How much the sample topics keep for a slow reader; at least '
             '1000 messages', 1.0, 60.0),
    Declared('frame_id', '', '', 'TF frame of the samples; empty: base_link below the namespace '
             'of the node'),
    Declared('diagnostics_period', 1.0, 's', 'Time between two /diagnostics; a change is told at '
             'once. Others of the same name listen for them', 0.05, 1.0),
)


@dataclass(frozen=True)
class Settings:
    """The parameters of an adapter, by name; see DECLARED for their units."""

    mapping: str
    joint: str
    rate: float
    listen_time: float
    delay: float
    block_size: int
    silence: float
    largest_acceleration: float
    history: float
    frame_id: str
    diagnostics_period: float


def declare(node: Node) -> Settings:
    """Declare all on a node; all are read at the start, so a later change is refused by ROS."""
    told = {}
    for declared in DECLARED:
        descriptor: ParameterDescriptor = declared.descriptor()
        descriptor.read_only = True
        told[declared.name] = node.declare_parameter(
            declared.name, declared.default, descriptor).value
    return Settings(**told)
