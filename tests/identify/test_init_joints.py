"""Which of the joints that a robot logs side by side: init ..."""

from init_bench import gear_motor, GIVEN, init, write
import numpy as np
import pyarrow
from pyarrow import parquet
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import get_typestore, Stores

from servo_identify.cli import main
from servo_identify.data.column_names import ANGLE, looks_like
from servo_identify.data.reading import read_recordings
from servo_identify.init.joints import given_joint, joints_of, of_joint
from servo_identify.jobs.many_diagnoses import diagnosed, read_rigs
from servo_twin.description import servo_file


@pytest.fixture(scope='module')
def run():
    return gear_motor()


def robot(run, names):
    """Return the columns of three joints of which the last one moves."""
    still = 0.0 * run['time']
    held = {'q': run['q'], 'i': run['i'], 'u': run['u']}
    return {'time': run['time']} | {
        name.format(joint): held[kind] if joint == 2 else still
        for kind, name in names.items() for joint in range(3)}


@pytest.mark.parametrize('names', [
    {'q': 'actual_q_{}', 'i': 'actual_current_{}', 'u': 'voltage_{}'},
    {'q': 'q[{}]', 'i': 'iq[{}]', 'u': 'u[{}]'},
    {'q': 'joint{}_position', 'i': 'joint{}_current', 'u': 'joint{}_voltage'}])
def test_it_asks_for_the_joint_once_and_names_all_else_for_it(run, tmp_path, capsys, names):
    data = write(tmp_path / 'log.csv', robot(run, names))
    words = ['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions']
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "--joint NAME (of ['0', '1', '2']; what follows is for '0')" in said
    assert f"motor_position={names['q'].format(0)}:UNIT" in said and '--ratio' in said
    angle = f"load_position={names['q'].format(2)}:rad"
    assert init(data, tmp_path, '--joint', '2', '--si', '--column', angle) == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    np.testing.assert_allclose(one['current'], run['i'], atol=1e-6)
    # the column that is given says which joint it is
    assert init(data, tmp_path, '--si', '--column', angle, '--force') == 0
    assert main([*words, '--joint', '7']) == 2
    assert "has no such joint; it has ['0', '1', '2']" in capsys.readouterr().err


def arm(run, folder):
    """Write a table of an elbow, of a wrist that runs the other way, and of a hand at rest."""
    signs = {'elbow': 1.0, 'wrist': -1.0, 'hand': 0.0}
    return write(folder / 'arm.csv', {'time': run['time']} | {
        f'{joint}_{name}': sign * run[kind] for name, kind in (
            ('pos', 'q'), ('cur', 'i'), ('volt', 'u')) for joint, sign in signs.items()})


def test_all_joints_of_a_robot_get_files_of_their_own_and_a_file_of_jobs(run, tmp_path, capsys):
    data, folder = arm(run, tmp_path), tmp_path / 'arm'
    words = ['init', str(data), '-o', str(folder), '--joint', 'all', '--si', '--column',
             'load_position={joint}_pos:rad', *GIVEN]
    assert main([*words, '--load-inertia', 'wrist=130 kg cm2']) == 1
    said = capsys.readouterr()
    assert 'nothing moves' in said.out and 'nothing was written of hand' in said.err
    rigs = read_rigs(folder / 'rigs.yaml')
    assert [*rigs] == ['elbow', 'wrist'] and not (folder / 'hand.yaml').exists()
    inertias = {}
    for name, sign in (('elbow', 1.0), ('wrist', -1.0)):
        rig = rigs[name]
        (one,) = read_recordings(rig.bags, rig.servo, rig.mapping)
        np.testing.assert_allclose(one['current'], sign * run['i'], atol=1e-6)
        inertias[name] = servo_file.load(rig.servo).values['mechanism.load_inertia']
    assert inertias == pytest.approx({'elbow': 0.012, 'wrist': 0.013})
    assert main(words) == 2
    assert 'holds' in capsys.readouterr().err  # which files are there already


def test_what_several_joints_lack_is_said_once_for_all(run, tmp_path, capsys):
    data = arm(run, tmp_path)
    words = ['init', str(data), '-o', str(tmp_path / 'arm'), '--joint']
    assert main([*words, 'elbow,wrist']) == 2
    said = capsys.readouterr().err
    assert said.count('--rotor-inertia') == 1
    assert '--column motor_position={joint}_pos:UNIT' in said
    assert "--ratio 'elbow=100'" in said
    for more, what in ((('elbow,foot',), "it has ['elbow', 'wrist', 'hand']"),
                       (('all', '--ratio', 'foot=3'), "there is no joint 'foot' here"),
                       (('all', '-o', str(tmp_path / 's.yaml')), '-o is a folder')):
        assert main([*words, *more]) == 2
        assert what in capsys.readouterr().err
    one = write(tmp_path / 'one.csv', run)
    assert main(['init', str(one), '-o', str(tmp_path / 'arm'), '--joint', 'all']) == 2
    assert 'tells several joints apart' in capsys.readouterr().err


@pytest.mark.parametrize('unit', ['N m', '1/50 N m'])
def test_a_bag_of_a_robot_says_where_the_name_of_a_joint_stands(run, tmp_path, capsys, unit):
    data = bag_of_robot(tmp_path / 'robot.bag', run)
    assert main(['init', str(data), '-o', str(tmp_path / 'robot'), '--joint', 'hip,knee']) == 2
    said = capsys.readouterr().err
    assert "--column 'current=/joint_states.effort[{joint}]:N m'" in said
    assert '--column voltage=/{joint}/command.data:UNIT' in said
    assert main(['init', str(data), '-o', str(tmp_path / 'robot'), '--joint', 'all', *GIVEN,
                 '--column', f'current=/joint_states.effort[{{joint}}]:{unit}', '--column',
                 'voltage=/{joint}/command.data:V']) == 0
    rigs = read_rigs(tmp_path / 'robot' / 'rigs.yaml')
    for name, sign in (('hip', 1.0), ('knee', -1.0)):
        (one,) = read_recordings(rigs[name].bags, rigs[name].servo, rigs[name].mapping)
        np.testing.assert_allclose(one['current'], sign * run['i'][:len(one)], atol=1e-6)
        np.testing.assert_allclose(one['voltage'], sign * run['u'][:len(one)], atol=1e-6)


def bag_of_robot(path, run):
    """Write a bag of ROS 1 in which a hip and a knee move against each other."""
    store = get_typestore(Stores.ROS1_NOETIC)
    state, header, stamp, number = (store.types[name] for name in (
        'sensor_msgs/msg/JointState', 'std_msgs/msg/Header', 'builtin_interfaces/msg/Time',
        'std_msgs/msg/Float64'))
    with Writer(path) as bag:
        states = bag.add_connection('/joint_states', state.__msgtype__, typestore=store)
        told = {sign: bag.add_connection(f'/{joint}/command', number.__msgtype__, typestore=store)
                for joint, sign in (('hip', 1.0), ('knee', -1.0))}
        for k, (time, u, i, q) in enumerate(zip(*(run[one] for one in ('time', 'u', 'i', 'q')),
                                                strict=True)):
            at = 1_714_560_000_000_000_000 + round(1e9 * time)
            message = state(header(k, stamp(*divmod(at, 1_000_000_000)), ''), ['hip', 'knee'],
                            np.array([q, -q]), np.zeros(2), 0.045 * 50.0 * np.array([i, -i]))
            bag.write(states, at, store.serialize_ros1(message, state.__msgtype__))
            for sign, connection in told.items():
                bag.write(connection, at, store.serialize_ros1(number(sign * u),
                                                               number.__msgtype__))
    return path


def test_a_file_of_jobs_names_a_mapping_by_which_its_tables_are_read(run, tmp_path, monkeypatch):
    data = arm(run, tmp_path)
    assert init(data, tmp_path, '--joint', 'wrist', '--si', '--column',
                'load_position=wrist_pos:rad') == 0
    seen = []
    monkeypatch.setattr('servo_identify.diagnose.diagnose.diagnose', lambda read, servo: (
        seen.append(read), exec('raise ValueError("enough")')))
    with pytest.raises(ValueError, match='enough'):
        diagnosed(str(tmp_path / 'new' / 's.yaml'), [str(data)], str(tmp_path / 'answer'),
                  str(tmp_path / 'new' / 'm.yaml'))
    np.testing.assert_allclose(seen[0][0]['current'], -run['i'], atol=1e-6)


def test_joints_are_told_apart_by_words_where_two_columns_have_the_same():
    positions = ['left_hip_pos [rad]', 'left_knee_pos [rad]']
    currents = ['left_hip_cur', 'left_knee_cur']
    assert joints_of([positions, currents], messages=False) == ['hip', 'knee']
    assert joints_of([positions, []], messages=False) == []
    assert of_joint([*positions, *currents, 't'], 'knee', messages=False,
                    known=['hip', 'knee']) == ['left_knee_pos [rad]', 'left_knee_cur', 't']


def test_two_channels_of_a_scope_are_no_joints():
    assert joints_of([['current (1)', 'current (2)']], messages=False) == []
    assert joints_of([['a1', 'a2'], ['b1', 'b2', 'b3']], messages=False) == []
    assert joints_of([['q[left]', 'q[right]']], messages=True) == ['left', 'right']


def test_what_is_of_no_joint_stays():
    names = ['q1 [deg]', 'q2 [deg]', 'i1', 'i2', 't', 'state_7']
    assert of_joint(names, '2', messages=False) == ['q2 [deg]', 'i2', 't', 'state_7']
    assert of_joint(names, '', messages=False) == names
    assert given_joint(['i1', 'q2 [deg]'], ['1', '2'], messages=False) == ''


def test_a_data_set_of_lerobot_is_asked_for_a_joint_and_never_for_a_count_of_frames(
        run, tmp_path, capsys):
    rows = len(run['time'])
    data = tmp_path / 'file-000.parquet'
    parquet.write_table(pyarrow.table({
        'frame_index': np.arange(rows), 'task_index': np.zeros(rows), 'index': np.arange(rows),
        'timestamp': run['time'], 'observation.state': np.stack([run['q'], run['u']], 1).tolist(),
        'action': np.stack([run['q'], run['u']], 1).tolist()}), data)
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions']) == 2
    said = capsys.readouterr().err
    assert 'motor_position=observation.state[0]:UNIT' in said
    assert 'reference_position=action[0]:UNIT' in said
    assert '--joint' in said and '_index' not in said


@pytest.mark.parametrize(('name', 'column'), [
    ('motor_state[3].q', ANGLE), ('motorState.q', ANGLE), ('motor_cmd[3].q', 'reference_position'),
    ('motor_cmd[3].kp', ''), ('motor_q', 'motor_position'),
    ('observation.state[elbow.vel]', ''), ('observation.images', ''), ('Vm', 'voltage'),
    ('tout', 't')])
def test_it_knows_what_robots_call_their_columns(name, column):
    assert looks_like(name) == column
