"""A rosbag2 of anybody's messages: the import ..."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from servo_identify.data.reading import read_recordings

CONFIG = Path(__file__).resolve().parents[2] / 'config'
SERVO = CONFIG / 'servos' / 'rv_plain.yaml'
PERIOD, COUNT, START = 5_000_000, 400, 1_700_000_000_000_000_000  # ns
STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(get_types_from_msg(
    'string[] interface_names\nfloat64[] values', 'control_msgs/msg/InterfaceValue'))
STORE.register(get_types_from_msg(
    'std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] '
    'interface_values', 'control_msgs/msg/DynamicJointState'))
T = STORE.types


def angle(k):
    return 0.2 * np.sin(0.05 * k)


def header(ns):
    stamp = T['builtin_interfaces/msg/Time'](sec=ns // 10**9, nanosec=ns % 10**9)
    return T['std_msgs/msg/Header'](stamp=stamp, frame_id='')


@pytest.fixture(scope='module', params=[StoragePlugin.MCAP, StoragePlugin.SQLITE3],
                ids=['mcap', 'sqlite3'])
def bag(request, tmp_path_factory):
    """Return a bag whose messages arrive late by a jitter that their headers do not have."""
    path = tmp_path_factory.mktemp('bags') / 'log'
    jitter = np.random.default_rng(3).integers(1_000_000, 4_000_000, COUNT)
    with Writer(path, version=9, storage_plugin=request.param) as writer:
        def topic(name, kind):
            connection = writer.add_connection(name, kind, typestore=STORE)
            return lambda ns, **fields: writer.write(
                connection, ns, STORE.serialize_cdr(T[kind](**fields), kind))

        joints = topic('/joint_states', 'sensor_msgs/msg/JointState')
        dynamic = topic('/dynamic_joint_states', 'control_msgs/msg/DynamicJointState')
        command = topic('/command', 'std_msgs/msg/Float64')
        for k in range(COUNT):
            at = START + k * PERIOD
            joints(at + int(jitter[k]), header=header(at), name=['wrist', 'joint'],
                   position=np.array([9.0, angle(k)]), velocity=np.array([]),
                   effort=np.array([]))
            values = T['control_msgs/msg/InterfaceValue'](
                interface_names=['position', 'current'], values=np.array([angle(k), 0.01 * k]))
            dynamic(at + int(jitter[k]), header=header(at), joint_names=['joint'],
                    interface_values=[values])
            if k % 10 == 0:
                command(at, data=float(k))
    return path


def test_it_takes_a_joint_by_name_at_header_times_and_holds_the_command(bag):
    one, = read_recordings([bag], SERVO, CONFIG / 'imports' / 'joint_state.yaml')
    assert one.period == pytest.approx(0.005)
    assert np.allclose(one['load_position'], angle(np.arange(COUNT)), atol=1e-12)
    assert np.array_equal(one['voltage'], np.arange(COUNT) // 10 * 10.0)


def test_it_reads_own_messages_by_the_definitions_in_the_bag(bag, tmp_path):
    mapping = tmp_path / 'mapping.yaml'
    one = '/dynamic_joint_states.interface_values[joint].values'
    mapping.write_text('time: {source: /dynamic_joint_states.stamp}\ncolumns:\n'
                       f'  load_position: {{source: "{one}[position]"}}\n'
                       f'  current: {{source: "{one}[1]", scale: 2.0}}\n')
    read, = read_recordings([bag], SERVO, mapping)
    assert np.allclose(read['load_position'], angle(np.arange(COUNT)), atol=1e-12)
    assert np.allclose(read['current'], 0.02 * np.arange(COUNT))


@pytest.mark.parametrize(('source', 'words'), [
    ('/joint_state.position[joint]', ['no topic', '/joint_states']),
    ('/joint_states.position[elbow]', ["no 'elbow'", "'wrist', 'joint'"]),
    ('/joint_states.angle[joint]', ["no 'angle'", "'position'"]),
    ('/joint_states.position', ['is no number'])])
def test_it_says_what_there_is_where_a_mapping_names_what_is_not(bag, tmp_path, source, words):
    mapping = tmp_path / 'mapping.yaml'
    mapping.write_text('time: {source: /joint_states.stamp}\ncolumns:\n'
                       f'  load_position: {{source: "{source}"}}\n')
    with pytest.raises(ValueError) as refusal:
        read_recordings([bag], SERVO, mapping)
    for word in words:
        assert word in str(refusal.value)
