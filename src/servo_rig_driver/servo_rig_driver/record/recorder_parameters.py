"""What a recorder can be told, and the topics that it records."""

from __future__ import annotations

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from ..given_parameters import judge_remaps

EVENT = 'servo_twin_msgs/msg/Event'
COMMAND = 'servo_twin_msgs/msg/Command'
OWN = {'recording': 'servo_twin_msgs/msg/RecordingInfo', 'note': 'std_msgs/msg/String',
       'events': EVENT}
"""What the recorder itself publishes and hears."""
DEFAULT_TOPICS = {
    'encoder': 'servo_twin_msgs/msg/Encoder',
    'torque': 'servo_twin_msgs/msg/Torque',
    'current': 'servo_twin_msgs/msg/Current',
    'command': COMMAND,
    'joint_states': 'sensor_msgs/msg/JointState',
    'twin/prediction': 'servo_twin_msgs/msg/Prediction',
    'twin/residual': 'servo_twin_msgs/msg/Residual',
    'twin/plot/residual': 'servo_twin_msgs/msg/PlotResidual',
    'events': EVENT,
    '/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray',
    '/parameter_events': 'rcl_interfaces/msg/ParameterEvent',
}
"""What is recorded when nothing else is said; others are given as 'name:package/msg/Type'."""


def declare(node: Node) -> None:
    """Declare what a recorder can be told: read at the start, so ROS refuses a later change."""
    def one(name: str, default: object, text: str, **limits: object) -> None:
        node.declare_parameter(name, default, ParameterDescriptor(
            description=text, read_only=True, **limits))

    one('topics', list(DEFAULT_TOPICS), 'Topics to record: names that the recorder knows, '
        "or 'name:package/msg/Type'; relative names are in the node's namespace")
    one('output', '', 'Bag directory to create; empty: recordings/<date and time>')
    one('servo_file', '', 'Servo file that is stored with the bag: a path or a '
        'shipped name such as rv_plain; empty: none')
    one('family', '', 'Excitation family, such as speed_ladder; empty: not said')
    one('replicate', 0, 'Number of this recording of the same excitation; 0: not said',
        integer_range=[IntegerRange(from_value=0, to_value=2**31 - 1, step=1)])
    one('note', '', 'Free text')
    one('chunk_bytes', 1 << 20, 'Uncompressed bytes after which a chunk goes to disk',
        integer_range=[IntegerRange(from_value=1 << 12, to_value=1 << 20, step=1)])
    one('chunk_seconds', 0.5, 'Age [s] at which a chunk goes to disk: what a killed '
        'recorder loses', floating_point_range=[
            FloatingPointRange(from_value=0.01, to_value=60.0)])
    one('history', 5000, 'Messages a topic that may wait while the recorder is busy',
        integer_range=[IntegerRange(from_value=1000, to_value=1_000_000, step=1)])


def topics_of(node: Node) -> dict[str, str]:
    """
    Return the types of the topics to record, by resolved name.

    Raises ValueError for one without a type, and where two of different types have one name.
    """
    topics = {}
    for entry in node.get_parameter('topics').value:
        name, _, kind = entry.partition(':')
        kind = kind or DEFAULT_TOPICS.get(name, '')
        if kind.count('/') != 2:
            raise ValueError(f"topics: {entry!r} has no type; write 'name:package/msg/Type', "
                             f'or one of {list(DEFAULT_TOPICS)}')
        topics[name] = kind
    judge_remaps(node, topics | OWN)
    return {node.resolve_topic_name(name): kind for name, kind in topics.items()}


def of_one_node(topics: dict[str, str]) -> list[str]:
    """Return those of topics, types by name, that one node alone publishes beside a rig."""
    return [topic for topic, kind in topics.items()
            if kind.startswith('servo_twin_msgs/') and kind not in (EVENT, COMMAND)]
