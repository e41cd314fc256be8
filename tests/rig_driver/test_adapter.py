"""The adapter: samples from what another driver publishes, beside a robot it never touches."""

from math import isnan
from pathlib import Path
import signal
import subprocess
import sys
from types import SimpleNamespace

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from driver_bench import Listener, value, wait_for
import numpy as np
import pytest
from rcl_interfaces.msg import Log
from sensor_msgs.msg import ChannelFloat32, JointState
from std_msgs.msg import Float64, Header
import yaml

from servo_identify.data.mapping import read_mapping as read_as_import_does
from servo_rig_driver.adapter.adapter_parameters import DECLARED
from servo_rig_driver.adapter.clock_offset import ClockOffset
from servo_rig_driver.adapter.even_samples import EvenSamples, Track, usual_step
from servo_rig_driver.adapter.mapped_columns import MappingError, read_mapping
from servo_rig_driver.adapter.message_field import Field, FieldError, stamp_of
from servo_rig_driver.driver.sample_blocks import COLUMNS
from servo_twin.bag import read_predictions, read_recording
from servo_twin.cli import main

ROOT = Path(__file__).resolve().parents[2]
IMPORTS = ROOT / 'config' / 'imports'
STACK = ROOT / 'tests' / 'support' / 'ros2_control_stack.py'
MS = 10**6
S = 1000 * MS


def dynamic(**interfaces):
    """Return what control_msgs/DynamicJointState is, whose package has no wheel."""
    return SimpleNamespace(joint_names=['knee', 'hip'], interface_values=[
        SimpleNamespace(interface_names=[], values=[]),
        SimpleNamespace(interface_names=list(interfaces), values=list(interfaces.values()))])


def test_it_reads_a_field_by_the_names_that_the_message_lists():
    state = JointState(name=['knee', 'hip'], position=[1.0, 2.0], velocity=[])
    assert Field('/joint_states.position[hip]').of(state) == 2.0
    assert Field('/joint_states.position[0]').of(state) == 1.0
    assert isnan(Field('/joint_states.velocity[hip]').of(state))
    both = Field('/dynamic_joint_states.interface_values[hip].values[current]')
    assert both.topic == '/dynamic_joint_states'
    assert both.of(dynamic(position=0.5, current=3.0)) == 3.0
    one_name = ChannelFloat32(name='leg_1', values=[3.0, 4.0, 5.0, 6.0, 7.0])
    assert Field('/leg.values[1]').of(one_name) == 4.0  # not where the name has a 1
    with pytest.raises(FieldError, match=r"no 'hips'; names are \['knee', 'hip'\]"):
        Field('/joint_states.position[hips]').of(state)
    with pytest.raises(FieldError, match="there is no 'torque'; there are .*'effort'"):
        Field('/joint_states.torque[hip]').of(state)
    with pytest.raises(FieldError, match='names no field of a topic'):
        Field('/joint_states')


def test_it_takes_the_stamp_of_a_message_without_a_header():
    stamp = Time(sec=3, nanosec=5)
    for message in (Log(stamp=stamp), JointState(header=Header(stamp=stamp))):
        assert stamp_of(message) == 3_000_000_005
    for message in (Float64(data=1.0), JointState(), SimpleNamespace(stamp=2.5)):
        assert stamp_of(message) == 0


@pytest.mark.parametrize('name', ['joint_state', 'ros2_control', 'ros2_control_joint'])
def test_it_takes_the_mapping_files_of_the_import(name):
    path = IMPORTS / f'{name}.yaml'
    ours, theirs = read_mapping(path, 'hip'), read_as_import_does(path)
    assert {c.name: c.field.source for c in ours.columns} == {
        column: steps['source'].replace('[joint]', '[hip]')
        for column, steps in theirs.columns.items() if column != 't'}
    assert theirs.columns['t']['source'] == f'{ours.leading}.stamp'


@pytest.mark.parametrize('text, said', [
    ('columns: {}', "'time' and 'columns' must be there"),
    ('time: {source: /a.stamp}\ncolumns: {angle: {source: /a.x}}', "no column 'angle'; columns"),
    ('time: {source: /a.stamp}\ncolumns: {torque: {source: /a.x, zero: mean}}', 'whole recording'),
    ('time: {source: /a.stamp}\ncolumns: {torque: {source: /a.x, scale: .nan}}', 'scale = nan is'),
    ('period: 1.0e-7\ntime: {source: /a.stamp}\ncolumns: {torque: {source: /a.x}}',
     'period = 1e-07 s is outside .5e-05, 1.; leave it out'),
    ('time: {source: /a.x}\ncolumns: {torque: {source: /a.x}}', 'write /a.stamp'),
    ('time: {source: /a.stamp}\ncolumns: {torque: {source: /a.x, times: b}}', "no 'times' here"),
    ('time: {source: /a.stamp}\nrows: data\ncolumns: {torque: {source: /a.x}}', 'are of tables')])
def test_it_refuses_a_mapping_that_it_cannot_follow(tmp_path, text, said):
    path = tmp_path / 'mapping.yaml'
    path.write_text(text)
    with pytest.raises(MappingError, match=said):
        read_mapping(path)


def test_it_takes_the_steps_of_a_mapping_in_their_order(tmp_path):
    path = tmp_path / 'mapping.yaml'
    path.write_text('time: {source: /a.stamp}\ncolumns:\n  torque: {source: /a.x, above: 32767, '
                    'subtract: 65536, scale: 0.5, offset: 1.0, negate: true}\n'
                    '  current: {value: 2}')
    mapped = read_mapping(path)
    assert mapped.columns[0].of(SimpleNamespace(x=65534)) == -(-2 * 0.5 + 1.0)
    assert mapped.constants == {'current': 2.0}


def test_stamps_of_another_clock_are_brought_to_ours_and_those_of_our_own_stay():
    own, other = ClockOffset(), ClockOffset()
    seen = []
    for k in range(3000):
        now = 1000 * S + k * 2 * MS
        transit = (k * 7919 % 13) * MS // 10
        assert own.local(now - transit, now) == now - transit
        drift = k * 20  # ns: 10 ppm
        seen.append(other.local(now - transit - 5 * S + drift, now) - (now - transit))
    assert abs(other.offset - 5 * S) < 2 * MS
    assert np.abs(np.diff(seen[600:])).max() < 10_000  # ns: no step of time
    assert own.offset == own.jumps == other.jumps == 0
    assert other.local(0, 7) == 7
    for k in range(1200):  # its clock is set
        other.local(2000 * S + k * 2 * MS, 1006 * S + k * 2 * MS)
    assert other.jumps == 1 and abs(other.offset + 994 * S) < 2 * MS


def test_measurements_are_interpolated_commands_hold_and_holes_are_left_out():
    angle, volts = COLUMNS.index('motor_position'), COLUMNS.index('voltage')
    lead, other = Track([angle], [False]), Track([volts], [True])
    even = EvenSamples({'a': lead, 'b': other}, 'a', 100 * MS, 2 * MS, 5 * MS, {'torque': 9.0})
    other.put(101 * MS, [1.0])
    for at in (100, 101, 103, 105, 107, 130, 132):
        lead.put(at * MS, [float(at)])
    assert not lead.put(131 * MS, [0.0])
    assert [n for n, _ in even.take(102 * MS)] == [0]  # the others may still come
    other.put(106 * MS, [2.0])
    rows = dict(even.take(200 * MS))
    assert {n: row[angle] for n, row in rows.items()} == {
        1: 102.0, 2: 104.0, 3: 106.0, 15: 130.0, 16: 132.0}
    assert [row[volts] for row in rows.values()] == [1.0, 1.0, 2.0, 2.0, 2.0]
    assert rows[1][COLUMNS.index('torque')] == 9.0
    assert isnan(rows[1][COLUMNS.index('current')])
    assert even.missing == 11


def test_a_topic_that_goes_on_while_the_leading_one_is_silent_takes_no_more_memory():
    angle, volts = COLUMNS.index('motor_position'), COLUMNS.index('voltage')
    lead, other = Track([angle], [False]), Track([volts], [True])
    even = EvenSamples({'a': lead, 'b': other}, 'a', 0, MS, 5 * MS, {})
    for at in range(60_000):
        other.put(at * MS, [float(at)])
    assert len(other.times) == len(other.rows) < 11_000
    lead.put(59_990 * MS, [1.0])
    lead.put(59_991 * MS, [1.0])
    assert [row[volts] for _, row in even.take(60_000 * MS)][-1] == 59_991.0


@pytest.mark.parametrize('rate, off', [(500.0, 0.2), (1000.0, 0.3), (125.0, 0.1), (333.3, 0.0)])
def test_the_rate_of_an_uneven_loop_is_found(rate, off):
    chance = np.random.default_rng(1)
    times = (np.arange(400) + off * chance.uniform(-1.0, 1.0, 400)) * 1e9 / rate
    times = np.delete(times, [50, 51, 52, 53, 200])
    assert usual_step([int(t) for t in times]) == pytest.approx(1e9 / rate, rel=2e-3)


def test_its_shipped_file_has_all_its_parameters():
    shipped = yaml.safe_load((ROOT / 'config' / 'adapter.yaml').read_text())
    given = shipped['/**/adapter']['ros__parameters']
    assert given == {d.name: d.default for d in DECLARED} | {'mapping': 'joint_state'}


@pytest.mark.ros
def test_it_says_what_it_cannot_use():
    for given, said in ((['mapping:=no_such'], 'a shipped name: ['), (['rate:=-1.0'], 'rate'),
                        (['mapping:=joint_state'], "is the parameter 'joint'")):
        ended = subprocess.run(
            [sys.executable, '-m', 'servo_rig_driver.adapter.adapter_node', '--ros-args',
             *(word for one in given for word in ('-p', one))], capture_output=True, text=True,
            timeout=60)
        assert ended.returncode == 2
        assert said in ended.stderr and 'Traceback' not in ended.stderr


def node(module, namespace, *parameters):
    return subprocess.Popen(
        [sys.executable, '-m', module, '--ros-args', '-r', f'__ns:=/{namespace}',
         *(word for one in parameters for word in ('-p', one))],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@pytest.mark.long
@pytest.mark.ros
@pytest.mark.slow
def test_a_twin_runs_beside_a_robot_whose_drives_nobody_touches(tmp_path, capsys):
    bag = tmp_path / 'bag'
    ears = Listener('hip')
    states, told = [], {}

    def hear(message: DiagnosticArray) -> None:
        for status in message.status:
            told[status.name] = status

    ears.node.create_subscription(JointState, '/joint_states', states.append, 5000)
    ears.node.create_subscription(DiagnosticArray, '/diagnostics', hear, 100)
    mapping = 'mapping:=ros2_control_joint'
    servo = 'servo_file:=ros2_control_joint'
    adapter = 'servo_rig_driver.adapter.adapter_node'
    running = [node(adapter, 'hip', mapping, 'joint:=hip', 'rate:=500.0'),
               node(adapter, 'knee', mapping, 'joint:=knee'),
               node('servo_twin.nodes.twin_node', 'hip', servo, 'autostart:=true'),
               node('servo_rig_driver.record.recorder_node', 'hip', servo, f'output:={bag}')]
    stack = None
    try:
        wait_for(lambda: {'/hip/adapter: rig', '/knee/adapter: rig', '/hip/twin: twin',
                          '/hip/recorder: recording'} <= set(told), 'all are there', 60.0)
        wait_for(lambda: 'nobody publishes /joint_states' in told['/hip/adapter: topics'].message,
                 'the adapter says that the robot is not there')
        assert told['/hip/adapter: topics'].level == b'\x02'
        stack = subprocess.Popen([sys.executable, STACK, '7', 'clock=5.0', 'lose=0.002',
                                  'gravity=3.0', 'still=2.0'])
        wait_for(lambda: value(told['/knee/adapter: rig'], 'state') == 'adapting'
                 and 'torque_balance' in told['/hip/twin: twin'].message, 'the gap is seen', 30.0)
        facts = {pair.key: pair.value for pair in told['/hip/adapter: rig'].values}
        assert facts['rate'] == '500 Hz'
        assert float(facts['clock of /joint_states'].split()[0]) == pytest.approx(5.0, abs=0.1)
        assert facts['/joint_states'].startswith('sensor_msgs/msg/JointState, ')
        stack.wait(30.0)
        wait_for(lambda: 'is silent' in told['/hip/adapter: topics'].message, 'it is silent')
    finally:
        for process in reversed(running):
            process.send_signal(signal.SIGINT)
        ended = [process.wait(60.0) for process in running]
        if stack is not None and stack.poll() is None:
            stack.kill()
        ears.close()
    assert ended == [0] * len(running)
    recording = read_recording(bag)
    assert recording.period == 2e-3 and len(recording) > 800
    at = np.array([m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for m in states]) - 5.0
    angle, effort = (np.array([row(m)[0] for m in states]) for row in (
        lambda m: m.position, lambda m: m.effort))
    steady = recording.time > 1.5  # the offset of the clock is told by the fastest message
    shift = np.interp(recording.time + recording.start, at, angle) - recording['motor_position']
    # rad: 25 ms at 4 rad/s; where the machine stood still, no message was fast
    assert np.nanquantile(np.abs(shift[steady]), 0.9) < 0.1
    assert set(np.round(recording['voltage'][~np.isnan(recording['voltage'])], 9)) <= set(
        np.round(effort, 9))
    assert len(read_predictions(bag)) > 300
    main(['replay', str(bag), '--compare'])
    said = capsys.readouterr().out
    assert 'identical to the last bit' in said and 'is silent: no sample' in ' '.join(said.split())
