"""A rosbag2 of anybody's messages: the import ..."""

import json
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from servo_identify.cli import main
from servo_identify.data.message_times import on_one_clock, stamp_of
from servo_identify.data.messages import fields_of
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


def moving(folder, clock=0, names=('wrist', 'joint'), without=range(0), rate=1.0, others=(),
           later=0, back=0):
    """
    Write a joint of 200 Hz whose header counts from a ``clock``, and a command without one.

    ``others`` are joints that another node publishes, so many ns ``later``. Half way through the
    clock is set ``back``, ns.
    """
    with Writer(folder / 'log', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        joints = writer.add_connection('/joint_states', 'sensor_msgs/msg/JointState',
                                       typestore=STORE)
        command = writer.add_connection('/command', 'std_msgs/msg/Float64', typestore=STORE)
        for k in range(COUNT):
            came = START + int(k * PERIOD / rate)
            clock -= back if k == COUNT // 2 else 0
            order = list(names) if k % 3 else list(reversed(names))
            here = [name for name in order if name != 'joint' or k not in without]
            content = T['sensor_msgs/msg/JointState'](
                header=header(clock + k * PERIOD), name=here,
                position=np.array([angle(k) if name == 'joint' else 9.0 for name in here]),
                velocity=np.array([]), effort=np.array([]))
            writer.write(joints, came + 100_000,
                         STORE.serialize_cdr(content, 'sensor_msgs/msg/JointState'))
            if others:
                content.header, content.name = header(clock + k * PERIOD + later), list(others)
                content.position = np.zeros(len(others))
                writer.write(joints, came + 120_000 + later,
                             STORE.serialize_cdr(content, 'sensor_msgs/msg/JointState'))
            writer.write(command, came + 150_000, STORE.serialize_cdr(
                T['std_msgs/msg/Float64'](data=float(k)), 'std_msgs/msg/Float64'))
    return folder / 'log'


@pytest.mark.parametrize(('clock', 'rate'), [(0, 1.0), (0, 0.5), (1_000_000_000_000, 1.0)])
def test_a_topic_of_another_clock_is_joined_by_its_receipt(tmp_path, clock, rate):
    one, = read_recordings([moving(tmp_path, clock, rate=rate)], SERVO,
                           CONFIG / 'imports' / 'joint_state.yaml')
    assert len(one) == COUNT and one.period == pytest.approx(0.005)
    assert np.allclose(one['load_position'], angle(np.arange(COUNT)), atol=1e-12)
    # what comes a moment after its row acts with it, not a row later
    assert np.allclose(one['voltage'][1:], np.arange(1.0, COUNT), atol=0.02)
    assert 'voltage begins in row 2; the rows before stay NaN' in one.warnings
    assert any('another clock than /command' in said for said in one.warnings)


def test_messages_without_the_joint_are_no_rows_of_it(tmp_path):
    one, = read_recordings([moving(tmp_path, START, without=range(100))], SERVO,
                           CONFIG / 'imports' / 'joint_state.yaml')
    assert len(one) == COUNT - 100
    assert np.allclose(one['load_position'], angle(np.arange(100, COUNT)), atol=1e-12)


def test_a_joint_that_was_missing_for_a_while_leaves_a_hole(tmp_path):
    one, = read_recordings([moving(tmp_path, START, without=range(100, 200))], SERVO,
                           CONFIG / 'imports' / 'joint_state.yaml')
    assert len(one) == COUNT
    assert np.isnan(one['load_position'][100:200]).all()
    assert np.allclose(one['load_position'][200:], angle(np.arange(200, COUNT)), atol=1e-9)
    assert any('lie in holes' in said for said in one.warnings)


def test_init_is_told_the_joints_of_all_who_publish_them(tmp_path):
    found = fields_of(moving(tmp_path, START, others=('finger',)))
    assert {f'/joint_states.position[{joint}]' for joint in ('wrist', 'joint', 'finger')} <= set(
        found)


def test_where_a_clock_was_set_back_its_stamps_are_taken_on_by_their_receipt(tmp_path):
    log = moving(tmp_path, clock=START, back=503_700_000)
    one, = read_recordings([log], SERVO, CONFIG / 'imports' / 'joint_state.yaml')
    assert len(one) == COUNT and one.period == pytest.approx(0.005)
    assert np.allclose(one['load_position'], angle(np.arange(COUNT)), atol=1e-3)
    words = f'the clock of /joint_states was set back by 0.5037 s before message {COUNT // 2 + 1}:'
    assert any(said.startswith(words) for said in one.warnings)


def test_it_says_that_two_clocks_publish_one_topic():
    received = START + 5_000_000 * np.arange(COUNT)
    stamps = received - 500_000_000 * (np.arange(COUNT) % 2)
    times, said = on_one_clock({'/a': stamps}, {'/a': received}, '/a')
    assert np.array_equal(times['/a'], stamps)
    assert said[0].startswith('the stamps of /a go back by 0.495 s in message 2: its clock was')


@pytest.mark.parametrize('later', [0, 1_300_000])
def test_a_gripper_on_the_same_topic_costs_no_row_of_the_arm(tmp_path, later):
    log = moving(tmp_path, START, others=('finger',), later=later)
    one, = read_recordings([log], SERVO, CONFIG / 'imports' / 'joint_state.yaml')
    assert len(one) == COUNT and one.period == pytest.approx(0.005)
    assert np.allclose(one['load_position'], angle(np.arange(COUNT)), atol=1e-12)
    assert not any('missing' in said or 'not even' in said for said in one.warnings)


def test_a_joint_whose_name_is_a_number_is_taken_by_its_name(tmp_path):
    mapping = tmp_path / 'mapping.yaml'
    mapping.write_text((CONFIG / 'imports' / 'joint_state.yaml').read_text().replace(
        'position[joint]', 'position[0]'))
    one, = read_recordings([moving(tmp_path, START, names=('joint', '0'))], SERVO, mapping)
    assert (one['load_position'] == 9.0).all()


def test_it_says_what_to_write_where_messages_name_no_joints(tmp_path):
    nameless = moving(tmp_path, START, names=())
    with pytest.raises(ValueError, match=r"no 'joint'; .* a number in place of 'joint', 0 for"):
        read_recordings([nameless], SERVO, CONFIG / 'imports' / 'joint_state.yaml')


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


def test_it_reads_the_mapping_of_odrive_at_times_of_receipt(tmp_path):
    kind = 'odrive_can/msg/ControllerStatus'
    fields = ('pos_estimate', 'vel_estimate', 'iq_setpoint', 'iq_measured')
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg('\n'.join(f'float32 {one}' for one in fields), kind))
    with Writer(tmp_path / 'log', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection('/odrive_axis0/controller_status', kind,
                                           typestore=store)
        for k in range(50):
            values = dict(zip(fields, (0.01 * k, 0.0, 2.0, 1.5), strict=True))
            writer.write(connection, START + k * PERIOD,
                         store.serialize_cdr(store.types[kind](**values), kind))
    one, = read_recordings([tmp_path / 'log'], SERVO, CONFIG / 'imports' / 'odrive.yaml')
    assert np.allclose(one['motor_position'], 0.02 * np.pi * np.arange(50), atol=1e-5)
    assert one['voltage'][3] == 2.0 and one['current'][3] == 1.5
    mcap, = (tmp_path / 'log').glob('*.mcap')
    alone, = read_recordings([mcap], SERVO, CONFIG / 'imports' / 'odrive.yaml')
    assert np.array_equal(alone['motor_position'], one['motor_position'])


def json_mcap(path):
    """Write two topics of JSON at two rates, the faster one late by a jitter of its receipt."""
    from mcap.writer import Writer as Mcap
    jitter = np.random.default_rng(3).integers(1_000_000, 4_000_000, COUNT)
    with path.open('wb') as stream:
        writer = Mcap(stream)
        writer.start()
        schema = writer.register_schema('Drive', 'jsonschema', b'{}')
        drive = writer.register_channel('/drive', 'json', schema)
        command = writer.register_channel('/command', 'json', schema)
        for k in range(COUNT):
            at = START + k * PERIOD
            content = {'stamp': {'sec': at // 10**9, 'nsec': at % 10**9},
                       'name': ['wrist', 'joint'],
                       'joints': [{'q': 9.0}, {'q': angle(k), 'i': None if k == 5 else 0.1}]}
            writer.add_message(drive, at + int(jitter[k]), json.dumps(content).encode(), at)
            if k % 10 == 0:
                writer.add_message(command, at, json.dumps({'u': float(k)}).encode(), at)
        writer.finish()


def protobuf_mcap(path):
    """Write one message type of our own, whose definition lies in the file."""
    from google.protobuf import (
        descriptor_pb2,
        descriptor_pool,
        message_factory,
        timestamp_pb2,
    )
    from mcap_protobuf.writer import Writer as Mcap
    file = descriptor_pb2.FileDescriptorProto(
        name='drive.proto', package='own', syntax='proto3',
        dependency=['google/protobuf/timestamp.proto'])
    message = file.message_type.add(name='Drive')
    message.field.add(name='timestamp', number=1, type=11, label=1,
                      type_name='.google.protobuf.Timestamp')
    message.field.add(name='position', number=2, type=1, label=3)
    message.field.add(name='u', number=3, type=1, label=1)
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.AddSerializedFile(file.SerializeToString())
    drive = message_factory.GetMessageClass(pool.FindMessageTypeByName('own.Drive'))
    with path.open('wb') as stream, Mcap(stream) as writer:
        for k in range(COUNT):
            at = START + k * PERIOD
            one = drive(position=[9.0, angle(k)], u=float(k))
            one.timestamp.seconds, one.timestamp.nanos = at // 10**9, at % 10**9
            writer.write_message('/drive', one, log_time=at + 2_000_000, publish_time=at)


@pytest.mark.parametrize(('make', 'position', 'command'), [
    (json_mcap, '/drive.joints[joint].q', '/command.u'),
    (protobuf_mcap, '/drive.position[1]', '/drive.u')])
def test_it_reads_plain_mcap_with_json_and_protobuf(tmp_path, make, position, command):
    path, mapping = tmp_path / 'log.mcap', tmp_path / 'mapping.yaml'
    make(path)
    mapping.write_text('time: {source: /drive.stamp}\ncolumns:\n'
                       f'  load_position: {{source: "{position}"}}\n'
                       f'  voltage: {{source: "{command}"}}\n')
    one, = read_recordings([path], SERVO, mapping)
    assert one.period == pytest.approx(0.005)
    assert np.allclose(one['load_position'], angle(np.arange(COUNT)), atol=1e-12)
    assert one['voltage'][25] == (20.0 if make is json_mcap else 25.0)
    with pytest.raises(ValueError, match=r"topics are \[.*'/drive'.*servo-identify init"):
        read_recordings([path], SERVO)


@pytest.mark.parametrize('unit', [1, 10**3, 10**6, 10**9])
def test_a_stamp_may_be_a_number_of_the_calendar(unit):
    assert stamp_of({'timestamp': START / 10**9 * unit}) == pytest.approx(START, abs=1000)
    assert stamp_of({'timestamp': 12.5}) == 0  # counts from nobody knows when


def test_nothing_is_made_up_where_a_topic_was_silent(tmp_path):
    from servo_identify.data.rows_in_time import at_rows
    times = np.concatenate([np.arange(0.0, 0.1, 0.01), np.arange(0.5, 0.6, 0.01)])
    found = at_rows(np.array([0.055, 0.3, 0.555]), times, times)
    assert found[0] == pytest.approx(0.055) and np.isnan(found[1])
    assert at_rows(np.array([0.3]), times, times, ahead=0.01)[0] == pytest.approx(0.09)


@pytest.mark.parametrize('spoil', ['half', 'bytes'])
def test_a_damaged_mcap_ends_in_a_sentence(tmp_path, spoil):
    path, mapping = tmp_path / 'log.mcap', tmp_path / 'mapping.yaml'
    json_mcap(path)
    mapping.write_text('time: {source: /drive.stamp}\ncolumns:\n'
                       '  load_position: {source: "/drive.joints[joint].q"}\n')
    content = bytearray(path.read_bytes())
    if spoil == 'half':
        del content[len(content) // 2:]
    else:
        content[400:440] = bytes(40)
    path.write_bytes(content)
    with pytest.raises(ValueError, match='log.mcap'):
        read_recordings([path], SERVO, mapping)


def test_init_says_which_fields_of_the_joint_it_leaves_out(bag, tmp_path, capsys):
    main(['init', str(bag), '-o', str(tmp_path / 's.yaml'), '--joint', 'joint', '--no-questions',
          '--si', '--column', 'load_position=/joint_states.position[joint]', '--drive', 'current',
          '--gain', '1 A/V', '--torque-constant', '0.1 N m/A', '--rotor-inertia', '1 g cm2',
          '--load-inertia', '1 kg cm2', '--ratio', '1'])
    left = next(line for line in capsys.readouterr().out.splitlines() if 'left out' in line)
    assert '/dynamic_joint_states.interface_values[joint]' in left and 'wrist' not in left
