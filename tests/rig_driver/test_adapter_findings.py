"""An adapter beside a robot with odd habits says what is wrong: it ..."""

from itertools import count
from math import inf, nan
import signal
import subprocess
import sys
from types import SimpleNamespace

from adapter_robot import Robot
from diagnostic_msgs.msg import DiagnosticArray
from driver_bench import Listener, wait_for
import pytest
from sensor_msgs.msg import JointState

from servo_rig_driver.adapter.message_field import Field, FieldError


def test_it_finds_nothing_wrong_with_a_robot_that_says_all():
    robot = Robot().says(4)
    assert robot.told == '' and len(robot.blocks) > 50


@pytest.mark.parametrize('effort', [nan, inf, None])
def test_it_says_that_a_field_never_holds_a_number(effort):
    robot = Robot().says(3, effort=effort)
    assert 'voltage: /joint_states.effort[hip] holds no number' in robot.told
    robot.says(2, effort=0.5)
    assert robot.told == ''


def test_it_says_what_to_write_where_messages_name_no_joints():
    assert "no 'hip'; the message lists no names: write a number in place of 'hip'" in (
        Robot().says(3, joints=()).told)


def test_other_nodes_may_publish_their_own_joints_on_the_same_topic():
    robot = Robot(('/arm', '/gripper'))
    for _ in range(600):
        robot.says(0.005).says(0.005, joints=('finger',))
    assert robot.told == ''
    robot.says(2, joints=('finger',))
    assert "there is no 'hip'; names are ['finger']" in robot.told


def test_it_says_that_two_publish_the_same_joint():
    robot = Robot(('/arm', '/sliders')).says(3)
    assert "2 publishers, of ['/arm', '/sliders']" in robot.told and 'are mixed' in robot.told


def test_two_of_three_that_publish_the_same_joint_are_found_by_their_numbers():
    robot, arm, sliders = Robot(('/arm', '/gripper', '/sliders')), count(7000), count(1)
    for _ in range(400):
        robot.says(0.005, number=arm).says(0.005, joints=('finger',)).says(0.005, number=sliders)
    assert "3 publishers, of ['/arm', '/gripper', '/sliders'], and not one alone" in robot.told
    for _ in range(200):
        robot.says(0.005, number=arm).says(0.005, joints=('finger',))
    assert robot.told == ''
    robot.says(2, number=count(1))  # it was started again
    assert 'publishers' not in robot.told


def test_it_says_how_often_a_field_holds_no_number():
    robot = Robot()
    for _ in range(300):
        robot.says(0.005).says(0.005, effort=nan)
    assert 'voltage: /joint_states.effort[hip] holds no number in 100 of 200 mess' in robot.told


def test_a_joint_that_is_there_twice_is_none():
    robot = Robot().says(2, joints=('hip', 'hip'))
    assert "there are two 'hip' in one message" in robot.told and not robot.blocks


@pytest.mark.parametrize('points', [((0, 2.0), (1, 3.0)), ((0, 2.0),)])
def test_a_point_of_a_trajectory_is_taken_where_it_holds_at_once(points):
    def message(ahead):
        return SimpleNamespace(joint_names=['knee', 'hip'], points=[
            SimpleNamespace(time_from_start=SimpleNamespace(sec=at + ahead, nanosec=0),
                            positions=[0.0, angle]) for at, angle in points])
    source = Field('/arm/joint_trajectory.points[0].positions[hip]')
    assert source.of(message(0)) == 2.0
    with pytest.raises(FieldError, match='is a plan: its point is due 3 s after'):
        source.of(message(3))


def test_a_joint_whose_name_is_a_number_is_taken_by_its_name():
    state = JointState(name=['3', '1', '2'], position=[0.3, 0.1, 0.2])
    assert Field('/joint_states.position[1]').of(state) == 0.1
    assert Field('/joint_states.position[0]').of(state) == 0.3


@pytest.mark.ros
def test_its_diagnostics_go_on_while_simulated_time_stands_still():
    ears, told = Listener('paused'), []
    ears.node.create_subscription(DiagnosticArray, '/diagnostics', told.append, 100)
    adapter = subprocess.Popen(
        [sys.executable, '-m', 'servo_rig_driver.adapter.adapter_node', '--ros-args', '-p',
         'mapping:=ros2_control_joint', '-p', 'joint:=hip', '-p', 'use_sim_time:=true', '-p',
         'diagnostics_period:=0.2', '-r', '__ns:=/paused'])
    try:
        def heard():
            return [one for one in told if one.status[0].name == '/paused/adapter: rig'
                    and 'use_sim_time is set' in one.status[0].message]
        wait_for(lambda: len(heard()) > 3, 'it goes on saying why there are no samples')
    finally:
        adapter.send_signal(signal.SIGINT)
        assert adapter.wait(60.0) == 0
        ears.close()


@pytest.mark.ros
def test_it_says_of_which_topic_a_number_has_come_to_mean_another_joint(tmp_path):
    (tmp_path / 'robot.yaml').write_text(
        "time: {source: /joint_states.stamp}\n"
        "columns: {load_position: {source: '/joint_states.position[0]'}}\n")
    ears, told = Listener('order', commands=False), []
    ears.node.create_subscription(DiagnosticArray, '/diagnostics', told.append, 100)
    adapter = subprocess.Popen(
        [sys.executable, '-m', 'servo_rig_driver.adapter.adapter_node', '--ros-args', '-p',
         f'mapping:={tmp_path / "robot.yaml"}', '-p', 'block_size:=1', '-r', '__ns:=/order', '-r',
         '/joint_states:=other'])
    states = ears.node.create_publisher(JointState, '/order/other', 100)
    joints = {'hip': 0.1, 'knee': 0.2}

    def says_in_words(said):
        return any(said in one.message for array in told for one in array.status)

    def says(names, until):
        state = JointState(name=names, position=[joints[name] for name in names])

        def there():
            state.header.stamp = ears.node.get_clock().now().to_msg()
            states.publish(state)
            return until()
        wait_for(there, f'what it makes of {names}')
    try:
        says(['hip', 'knee'], lambda: len(ears.encoder) > 20)
        says(['knee', 'hip'], lambda: says_in_words(
            "number 0 was 'hip' at first, and is 'knee' by now"))
        wait_for(lambda: says_in_words('/order/other is silent: no sample'), 'it is silent')
        assert says_in_words('/order/other: /joint_states.position[0]')
        assert any(fact.key == '/order/other' for one in told[-1].status for fact in one.values)
        assert {one.load_position[0] for one in ears.encoder} == {0.1}
    finally:
        adapter.send_signal(signal.SIGINT)
        assert adapter.wait(60.0) == 0
        ears.close()
