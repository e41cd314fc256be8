"""Which of the joints that a robot logs side by side: init ..."""

from init_bench import gear_motor, init, write
import numpy as np
import pyarrow
from pyarrow import parquet
import pytest

from servo_identify.cli import main
from servo_identify.data.column_names import ANGLE, looks_like
from servo_identify.data.reading import read_recordings
from servo_identify.init.joints import given_joint, joints_of, of_joint


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
