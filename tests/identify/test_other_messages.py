"""Bags and messages as people have them: the import ..."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from servo_identify.data.messages import fields_of
from servo_identify.data.reading import read_recordings

CONFIG = Path(__file__).resolve().parents[2] / 'config'
SERVO = CONFIG / 'servos' / 'rv_plain.yaml'
PERIOD, COUNT, START = 5_000_000, 200, 1_700_000_000_000_000_000  # ns
JOINT = 'trajectory_msgs/msg/JointTrajectoryPoint'
CONTROLLER = 'control_msgs/msg/JointTrajectoryControllerState'


def angle(k):
    """Return the load's angle at sample k, rad."""
    return 0.2 * np.sin(0.05 * k)


def stamped(store, ns, **more):
    """Return a header of a type store at a time; ``seq`` for ROS 1."""
    stamp = store.types['builtin_interfaces/msg/Time'](sec=ns // 10**9, nanosec=ns % 10**9)
    return store.types['std_msgs/msg/Header'](stamp=stamp, frame_id='', **more)


def imported(path, tmp_path, text):
    """Return the recording of a file by the text of a mapping."""
    mapping = tmp_path / 'mapping.yaml'
    mapping.write_text(text)
    one, = read_recordings([path], SERVO, mapping)
    return one


def test_it_reads_a_ros_1_bag(tmp_path):
    store = get_typestore(Stores.ROS1_NOETIC)
    path = tmp_path / 'old.bag'
    with Writer1(path) as writer:
        def topic(name, kind):
            made = writer.add_connection(name, kind, typestore=store)
            return lambda ns, **fields: writer.write(
                made, ns, store.serialize_ros1(store.types[kind](**fields), kind))

        joints = topic('/joint_states', 'sensor_msgs/msg/JointState')
        command = topic('/command', 'std_msgs/msg/Float64')
        wrench = topic('/wrench', 'geometry_msgs/msg/WrenchStamped')
        vector = store.types['geometry_msgs/msg/Vector3']
        for k in range(COUNT):
            at = START + k * PERIOD
            late = at + 1_000_000 * (1 + k % 4)  # of the receipt; the headers do not have it
            joints(late, header=stamped(store, at, seq=k), name=['wrist', 'joint'],
                   position=np.array([9.0, angle(k)]), velocity=np.array([]), effort=np.array([]))
            wrench(late, header=stamped(store, at, seq=k),
                   wrench=store.types['geometry_msgs/msg/Wrench'](
                       force=vector(0.0, 0.0, 0.0), torque=vector(1.0, 2.0, 0.5 * k)))
            if k % 10 == 0:
                command(at, data=float(k))
    one = imported(path, tmp_path, (
        'time: {source: /joint_states.stamp}\ncolumns:\n'
        '  load_position: {source: "/joint_states.position[joint]"}\n'
        '  torque: {source: /wrench.wrench.torque.z}\n'
        '  voltage: {source: /command.data}\n'))
    assert one.period == pytest.approx(0.005)
    assert np.allclose(one['load_position'], angle(np.arange(COUNT)), atol=1e-12)
    assert np.allclose(one['torque'], 0.5 * np.arange(COUNT))
    assert np.array_equal(one['voltage'], np.arange(COUNT) // 10 * 10.0)


@pytest.fixture(scope='module')
def store():
    """Return a type store with the messages of ros2_control."""
    found = get_typestore(Stores.ROS2_JAZZY)
    points = '\n'.join(f'trajectory_msgs/JointTrajectoryPoint {name}' for name in
                       ('reference', 'feedback', 'error', 'output'))
    found.register(get_types_from_msg(
        f'std_msgs/Header header\nstring[] joint_names\n{points}', CONTROLLER))
    return found


@pytest.fixture(scope='module', params=[StoragePlugin.MCAP, StoragePlugin.SQLITE3],
                ids=['mcap', 'sqlite3'])
def controlled(request, tmp_path_factory, store):
    """Return a bag of a trajectory controller, and of a sensor of another rate and clock."""
    path = tmp_path_factory.mktemp('bags') / 'log'
    with Writer(path, version=9, storage_plugin=request.param) as writer:
        state = writer.add_connection('/arm/controller_state', CONTROLLER, typestore=store)
        wrench = writer.add_connection('/wrench', 'geometry_msgs/msg/WrenchStamped',
                                       typestore=store)
        vector, wrenches = (store.types[f'geometry_msgs/msg/{one}']
                            for one in ('Vector3', 'WrenchStamped'))

        def point(value, effort):
            return store.types[JOINT](
                positions=np.array([9.0, value]), velocities=np.array([0.0, 0.1]),
                accelerations=np.array([]), effort=np.array([0.0, effort]),
                time_from_start=store.types['builtin_interfaces/msg/Duration'](0, 0))

        for k in range(COUNT):
            at = START + k * PERIOD
            message = store.types[CONTROLLER](
                header=stamped(store, at), joint_names=['wrist', 'joint'],
                reference=point(angle(k + 1), 0.0), feedback=point(angle(k), 0.0),
                error=point(0.0, 0.0), output=point(0.0, 0.01 * k))
            writer.write(state, at + 2_000_000, store.serialize_cdr(message, CONTROLLER))
            if k % 2:  # half the rate, between two samples, recorded a second late
                between = at + PERIOD // 2
                push = wrenches(header=stamped(store, between),
                                wrench=store.types['geometry_msgs/msg/Wrench'](
                                    force=vector(0.0, 0.0, 0.0), torque=vector(0.0, 0.0, k + 0.5)))
                writer.write(wrench, between + 10**9,
                             store.serialize_cdr(push, 'geometry_msgs/msg/WrenchStamped'))
    return path


STATE = ('time: {source: /arm/controller_state.stamp}\ncolumns:\n'
         '  load_position: {source: "/arm/controller_state.feedback.positions[joint]"}\n'
         '  reference_position: {source: "/arm/controller_state.reference.positions[joint]"}\n'
         '  voltage: {source: "/arm/controller_state.output.effort[joint]"}\n'
         '  torque: {source: /wrench.wrench.torque.z}\n')


@pytest.mark.parametrize('alone', [False, True], ids=['folder', 'file alone'])
def test_it_joins_a_controller_and_a_sensor_by_their_headers(controlled, tmp_path, alone):
    path = controlled
    if alone:  # the .mcap or the .db3, without its metadata.yaml
        path = tmp_path / 'alone' / next(one for one in controlled.iterdir()
                                         if one.suffix in ('.mcap', '.db3')).name
        path.parent.mkdir()
        path.write_bytes(next(one for one in controlled.iterdir()
                              if one.suffix == path.suffix).read_bytes())
    one = imported(path, tmp_path, STATE)
    assert np.allclose(one['load_position'], angle(np.arange(COUNT)), atol=1e-12)
    assert np.allclose(one['reference_position'], angle(np.arange(1, COUNT + 1)), atol=1e-12)
    assert np.allclose(one['voltage'], 0.01 * np.arange(COUNT))
    inner = slice(2, COUNT - 1)
    assert np.allclose(one['torque'][inner], np.arange(COUNT)[inner], atol=1e-9)


def test_a_folder_of_several_files_is_read_whole(tmp_path, store):
    path = tmp_path / 'log'
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        joints = writer.add_connection('/joint_states', 'sensor_msgs/msg/JointState',
                                       typestore=store)
        for k in range(COUNT):
            message = store.types['sensor_msgs/msg/JointState'](
                header=stamped(store, START + k * PERIOD), name=['joint'],
                position=np.array([angle(k)]), velocity=np.array([]), effort=np.array([]))
            writer.write(joints, START + k * PERIOD,
                         store.serialize_cdr(message, 'sensor_msgs/msg/JointState'))
    one = imported(path, tmp_path, 'time: {source: /joint_states.stamp}\ncolumns:\n'
                   '  load_position: {source: "/joint_states.position[joint]"}\n')
    assert len(one) == COUNT and not one.has('torque')
    assert all(a < b for a, b in pairwise(one.time))


def test_the_layout_of_an_array_is_no_source(tmp_path, store):
    multi, layout, dimension = (store.types[f'std_msgs/msg/{one}'] for one in (
        'Float64MultiArray', 'MultiArrayLayout', 'MultiArrayDimension'))
    with Writer(tmp_path / 'bag', version=9) as writer:
        made = writer.add_connection('/commands', multi.__msgtype__, typestore=store)
        told = multi(layout=layout(dim=[dimension(label='joint', size=2, stride=2)],
                                   data_offset=0), data=np.array([0.5, 1.5]))
        writer.write(made, START, store.serialize_cdr(told, multi.__msgtype__))
    assert list(fields_of(tmp_path / 'bag')) == ['/commands.stamp', '/commands.data[0]',
                                                 '/commands.data[1]']
