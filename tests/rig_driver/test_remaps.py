"""Remaps that cannot be, or change nothing: a node ..."""

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


def started(module, remaps, folder):
    """Run a node with remaps in a namespace, up to its end."""
    more = {RECORDER: ['-p', 'output:=bag'],
            ADAPTER: ['-p', 'mapping:=joint_state', '-p', 'joint:=hip']}
    words = ['sine'] if module == PLAYER else []
    rules = [word for rule in remaps for word in ('-r', rule)]
    return subprocess.run(
        [sys.executable, '-m', module, *words, '--ros-args', '-r', '__ns:=/rig', *rules,
         *more.get(module, ())], capture_output=True, text=True, timeout=60.0, cwd=folder)


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
    ended = started(module, [remap], tmp_path)
    assert ended.returncode == 2, ended.stderr
    for part in said:
        assert part in ended.stderr
    assert 'Traceback' not in ended.stderr
    assert not list(tmp_path.iterdir())


IDLE = {'learn:=x': '', 'joint_state:=x': "did you mean 'joint_states'? ",
        'rostopic://nobody:=x': '', '~/load:=x': ''}
USED = ('torque:=v', '/rig/events:=e', '~/get_parameters:=g', '/rosout:=r', 'other:learn:=x')


def test_says_at_its_start_which_remap_changes_nothing(tmp_path):
    said = started(DRIVER, [*IDLE, *USED, 'command:=joint_states'], tmp_path).stderr
    for rule, meant in IDLE.items():
        source = rule.removeprefix('rostopic://').removesuffix(':=x')
        assert (f'the remap {rule} changes nothing: driver has no topic, service or action '
                f"'{source}'; {meant}it has ['encoder',") in said
    assert said.count('changes nothing') == len(IDLE)


@pytest.mark.parametrize(('remap', 'said'), [
    ('encoder:=torque', 'would both be the topic /rig/torque'),
    ('encoders:=x', "the remap encoders:=x changes nothing: experiment has no topic, service or "
     "action 'encoders'; did you mean 'encoder'?")])
def test_an_experiment_hears_of_remaps_as_other_nodes_do(remap, said):
    ended = subprocess.run(
        [sys.executable, '-c', 'import sys; from servo_identify.experiment.performer_node import '
         'Limits, Performer; Performer("rig", Limits())', '--ros-args', '-r', remap],
        capture_output=True, text=True, timeout=60.0)
    assert said in ended.stderr
