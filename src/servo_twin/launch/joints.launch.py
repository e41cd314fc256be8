"""
A twin beside each joint of a robot that has its own driver, such as one under ros2_control.

    ros2 launch servo_twin joints.launch.py joints:='[hip, knee]' servo:=/path/{joint}.yaml

Each joint gets a namespace with an adapter, a twin and, unless record:='', a recorder. Nothing of
it commands the robot.
"""

import re

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

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


def spaces(listed):
    """
    Return the namespace of each joint of a list as people write it.

    That is [hip, knee], hip,knee or hip knee, with quotes or without. A namespace has letters,
    digits and _ alone, and no digit first.
    """
    joints = re.findall(r'[^\s,\[\]\'"]+', listed)
    found = {joint: re.sub(r'^(?=\d)', 'joint_', re.sub(r'[^A-Za-z0-9_]', '_', joint))
             for joint in joints}
    if not joints or len(set(found.values())) < len(joints):
        raise ValueError(f'joints = {listed!r} is no list of different names, such as [hip, knee]')
    return found


def start(context):
    """Return the nodes of all joints."""
    of = {name: LaunchConfiguration(name).perform(context) for name, *_ in ARGUMENTS}
    try:
        rate = float(of['rate'])
    except ValueError:
        raise ValueError(f"rate = {of['rate']!r} is no number; give Hz, such as 500") from None
    nodes = []
    for joint, own in spaces(of['joints']).items():
        space = '/'.join(part for part in (of['namespace'].strip('/'), own) if part)
        servo = of['servo'].replace('{joint}', joint)

        def node(package, executable, space=space, **values):
            # a name such as 1 or on stays a name
            given = {key: ParameterValue(value, value_type=type(value))
                     for key, value in values.items()}
            return Node(package=package, executable=executable, namespace=space, output='screen',
                        parameters=[given])

        nodes.append(node('servo_rig_driver', 'adapter', mapping=of['mapping'], joint=joint,
                          rate=rate))
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
