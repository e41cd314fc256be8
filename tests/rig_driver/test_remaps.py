"""Remaps by which two topics of different types, or two services, have one name: a node ..."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.ros
RIG, TWIN = 'servo_rig_driver', 'servo_twin.nodes.twin_node'
DRIVER, ADAPTER = f'{RIG}.driver.driver_node', f'{RIG}.adapter.adapter_node'
RECORDER, PLAYER = f'{RIG}.record.recorder_node', f'{RIG}.record.player_node'
IDENTIFY = 'servo_identify.nodes.identify_node'
TYPES = 'servo_twin_msgs/msg'
SAMPLES = (f'encoder ({TYPES}/Encoder)', f'torque ({TYPES}/Torque)', 'the topic /rig/torque')


@pytest.mark.parametrize(('module', 'remap', 'said'), [
    (IDENTIFY, 'encoder:=torque', SAMPLES),
    (TWIN, 'encoder:=torque', SAMPLES),
    (DRIVER, 'encoder:=torque', SAMPLES),
    (ADAPTER, 'encoder:=torque', SAMPLES),
    (RECORDER, 'encoder:=torque', SAMPLES),
    (ADAPTER, '/joint_states:=encoder', ('/joint_states (of the robot)', 'topic /rig/encoder')),
    (PLAYER, 'command:=encoder', (f'command ({TYPES}/Command)', 'the topic /rig/encoder')),
    (DRIVER, 'command:=joint_states', ('sensor_msgs/msg/JointState', '-r command:=...')),
    (RECORDER, 'note:=events', ('note (std_msgs/msg/String)', 'the topic /rig/events')),
    (TWIN, 'events:=/rosout', ('/rosout (rcl_interfaces/msg/Log)', f'events ({TYPES}/Event)')),
    (TWIN, 'twin/load_servo:=twin/get_parameters', (
        '/rig/twin/get_parameters (rcl_interfaces/srv/GetParameters)',
        'the service /rig/twin/get_parameters')),
    (IDENTIFY, 'identify/go_back:=twin/load_servo', (
        'twin/load_servo (servo_twin_msgs/srv/LoadServo)',
        'identify/go_back (std_srvs/srv/Trigger)',
        'change the remaps (-r identify/go_back:=...)')),
    (IDENTIFY, 'identify/relearn:=identify/go_back', ('the service /rig/identify/go_back',))])
def test_refuses_at_its_start_what_would_share_a_name(module, remap, said, tmp_path):
    more = {RECORDER: ['-p', 'output:=bag'],
            ADAPTER: ['-p', 'mapping:=joint_state', '-p', 'joint:=hip']}
    words = ['sine'] if module == PLAYER else []
    ended = subprocess.run(
        [sys.executable, '-m', module, *words, '--ros-args', '-r', '__ns:=/rig', '-r', remap,
         *more.get(module, ())], capture_output=True, text=True, timeout=60.0, cwd=tmp_path)
    assert ended.returncode == 2, ended.stderr
    for part in said:
        assert part in ended.stderr
    assert 'Traceback' not in ended.stderr
    assert not list(tmp_path.iterdir())
