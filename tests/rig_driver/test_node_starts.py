"""A node that is started wrongly says what is wrong in a sentence."""

import os
import subprocess
import sys

from driver_bench import DriverProcess, Listener
import pytest
import rclpy
from rclpy.lifecycle import TransitionCallbackReturn

from servo_rig_driver.given_parameters import _fits
from servo_rig_driver.managed_node import ManagedNode
from servo_twin.nodes.given_parameters import _fits as fits_of_twin
from servo_twin.nodes.managed_node import ManagedNode as ManagedTwin

pytestmark = pytest.mark.ros
NODES = ('servo_rig_driver.driver.driver_node', 'servo_rig_driver.adapter.adapter_node',
         'servo_rig_driver.record.recorder_node', 'servo_twin.nodes.twin_node',
         'servo_identify.nodes.identify_node')


@pytest.mark.parametrize('module', NODES)
def test_a_parameter_file_that_ros_cannot_read_is_named(module, tmp_path):
    file = tmp_path / 'mine.yaml'
    file.write_text('driver:\n  protocol: odrive\n')
    ended = subprocess.run([sys.executable, '-m', module, '--ros-args', '--params-file', file],
                           capture_output=True, text=True, timeout=60.0)
    assert ended.returncode == 2
    assert f"Couldn't parse params file: '--params-file {file}'" in ended.stderr
    assert 'Cannot have a value before ros__parameters at line 2' in ended.stderr
    assert 'Traceback' not in ended.stderr


@pytest.mark.parametrize(('module', 'given', 'said'), [
    (NODES[0], 'device.ratio:=9', 'device.ratio = 9 is an integer, and it must be a number with a '
     'point: write 9.0'),
    (NODES[1], 'rate:=500', 'write 500.0'), (NODES[1], 'joint:=3', """write "joint:='3'\""""),
    (NODES[2], 'chunk_seconds:=1', 'write 1.0'), (NODES[2], 'history:=2.5', 'must be an integer'),
    (NODES[3], 'overload:=1', 'write 1.0'), (NODES[3], 'overload:=0.0', 'out of range Min: 0.1'),
    (NODES[4], 'trial:=5', 'write 5.0'), (NODES[4], 'buffer:=-1.0', 'out of range')])
def test_a_parameter_of_another_type_or_out_of_range_is_named_in_a_sentence(module, given, said):
    ended = subprocess.run([sys.executable, '-m', module, '--ros-args', '-p', given],
                           capture_output=True, text=True, timeout=60.0)
    assert ended.returncode == 2
    assert said in ended.stderr and 'Traceback' not in ended.stderr


def test_an_argument_that_ros_does_not_know_is_named():
    ended = subprocess.run([sys.executable, '-m', NODES[0], '--ros-args', '--parms-file', 'x'],
                           capture_output=True, text=True, timeout=60.0)
    assert ended.returncode == 2
    assert ended.stderr.strip() == (
        "driver_node: behind --ros-args, ROS knows no ['--parms-file', 'x']")


@pytest.mark.parametrize(('module', 'name'), [
    (NODES[0], 'driver'), (NODES[1], 'adapter'), (NODES[2], 'recorder')])
@pytest.mark.parametrize('part', ['/hip/{}', '{}'])
def test_a_file_for_a_node_of_another_namespace_is_not_passed_over(module, name, part, tmp_path):
    file = tmp_path / 'mine.yaml'
    file.write_text(f'{part.format(name)}:\n  ros__parameters: {{use_sim_time: false}}\n')
    ended = subprocess.run(
        [sys.executable, '-m', module, '--ros-args', '-r', '__ns:=/knee', '--params-file', file],
        capture_output=True, text=True, timeout=60.0)
    assert ended.returncode == 2
    assert f'and this node is /knee/{name}: none of its values would be taken' in ended.stderr


@pytest.mark.parametrize('fits', [_fits, fits_of_twin])
@pytest.mark.parametrize(('part', 'name', 'is_for'), [
    ('/**', '/a/b/driver', True), ('/**/driver', '/driver', True),
    ('/**/driver', '/a/b/driver', True), ('/*/driver', '/a/driver', True),
    ('/*/driver', '/a/b/driver', False), ('/a/driver', '/a/driver', True),
    ('/driver', '/a/driver', False), ('/a.b/*', '/acb/driver', False)])
def test_the_parts_of_a_file_are_for_the_nodes_that_ros_takes_them_for(fits, part, name, is_for):
    assert fits(part, name) is is_for


def test_a_choice_that_there_is_not_is_named_with_those_that_there_are():
    ears = Listener('wrong_choice')
    driver = DriverProcess('wrong_choice', protocol='odrvie')
    try:
        ears.hears('bus', "protocol = 'odrvie'; it is one of ['canopen', 'odrive', ", 2)
    finally:
        driver.close()
        ears.close()


@pytest.mark.parametrize('kind', [ManagedNode, ManagedTwin])
def test_a_transition_that_breaks_says_what_broke(kind, capfd):
    class Broken(kind):
        def on_configure(self, state):
            raise KeyError('no_such_table')

    rclpy.init()
    node = Broken('broken')
    try:
        assert node.trigger_configure() == TransitionCallbackReturn.ERROR
        assert "on_configure broke: KeyError: 'no_such_table'" in capfd.readouterr().err
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


@pytest.mark.parametrize('module', NODES)
def test_a_home_that_nobody_may_write_to_is_named_with_what_to_do(module):
    said = subprocess.run(
        [sys.executable, '-m', module], capture_output=True, text=True, timeout=60.0,
        env=os.environ | {'HOME': '/proc/nowhere', 'ROS_LOG_DIR': '', 'ROS_HOME': ''})
    assert said.returncode == 2
    assert '/proc/nowhere/.ros/log' in said.stderr and 'ROS_LOG_DIR' in said.stderr
    assert len(said.stderr.splitlines()) == 1


def test_a_driver_says_that_no_socket_can_have_the_path_of_its_bus():
    ears = Listener('far', commands=False)
    driver = DriverProcess('far', bus__channel=f'/tmp/{"deep/" * 40}rig.can', retry_period=0.1)
    try:
        ears.hears('bus', 'the path of a Unix socket has 1 to 107', 2)
    finally:
        said = driver.close()
        ears.close()
    assert 'broke' not in said and said.count('the path of a Unix socket') == 1
