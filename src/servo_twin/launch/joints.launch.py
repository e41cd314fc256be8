"""
A twin beside each joint of a robot that has its own driver, such as one under ros2_control.

    ros2 launch servo_twin joints.launch.py joints:='[hip, knee]' servo:=/path/{joint}.yaml

Each joint gets a namespace with an adapter, a twin and, unless record:='', a recorder. Nothing of
it commands the robot.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
import yaml

ARGUMENTS = (
    ('joints', None, 'list of joints, such as [hip, knee]'),
    ('servo', 'ros2_control_joint', 'servo file of the twins, path or shipped name; {joint} in it '
     'stands for the name of the joint'),
    ('mapping', 'ros2_control_joint', 'which field of which topic is which column: path or '
     'shipped name, as `servo-identify import` takes it'),
    ('rate', '0.0', 'samples a second; 0.0 measures that of the robot'),
    ('mode', 'measured_input', 'measured_input, closed_loop or observer'),
    ('namespace', '', 'namespace above those of the joints'),
    ('record', '', 'folder to make, with a bag for each joint; left out, nothing is recorded'),
)


def start(context):
    """Return the nodes of all joints."""
    of = {name: LaunchConfiguration(name).perform(context) for name, *_ in ARGUMENTS}
    joints = yaml.safe_load(of['joints'])
    joints = [joints] if isinstance(joints, str) else joints
    if not isinstance(joints, list) or not joints or not all(isinstance(j, str) for j in joints):
        raise ValueError(f"joints = {of['joints']!r} is no list of names, such as [hip, knee]")
    nodes = []
    for joint in joints:
        space = '/'.join(part for part in (of['namespace'].strip('/'), joint) if part)
        servo = of['servo'].replace('{joint}', joint)

        def node(package, executable, space=space, **values):
            return Node(package=package, executable=executable, namespace=space, output='screen',
                        parameters=[values])

        nodes.append(node('servo_rig_driver', 'adapter', mapping=of['mapping'], joint=joint,
                          rate=float(of['rate'])))
        nodes.append(node('servo_twin', 'twin_node', servo_file=servo, mode=of['mode'],
                          autostart=True))
        if of['record']:
            nodes.append(node('servo_rig_driver', 'recorder', servo_file=servo,
                              output=f"{of['record']}/{joint}"))
    return nodes


def generate_launch_description():
    """Return the arguments, and the nodes that come of them."""
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=value, description=text)
          for name, value, text in ARGUMENTS), OpaqueFunction(function=start)])
