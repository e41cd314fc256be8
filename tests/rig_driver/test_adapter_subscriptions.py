"""An adapter takes what the publishers of a robot offer, in every executor: it ..."""

from itertools import pairwise
import signal
import subprocess
import sys
from threading import Event, Thread

from driver_bench import Listener, wait_for
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from sensor_msgs.msg import JointState

from servo_rig_driver.adapter.robot_topics import falls_short, qos_of, RobotTopics
from servo_rig_driver.driver.rig_health import RigHealth

STATES = '/joint_states'


def test_it_asks_for_the_best_that_every_publisher_offers():
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    hasty = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    one = qos_of([latched, latched])
    assert one.durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert one.reliability == ReliabilityPolicy.RELIABLE
    both = qos_of([latched, hasty])
    assert both.durability == DurabilityPolicy.VOLATILE
    assert both.reliability == ReliabilityPolicy.BEST_EFFORT


def test_it_knows_what_would_never_match():
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    hasty = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    usual = QoSProfile(depth=1)
    assert falls_short(hasty, usual) and falls_short(usual, latched)
    assert not falls_short(usual, usual) and not falls_short(latched, usual)
    assert not falls_short(usual, hasty)


@pytest.mark.ros
def test_it_hears_a_robot_that_comes_back_with_a_weaker_offer():
    ears, over = Listener('back', commands=False), Event()
    adapter = subprocess.Popen(
        [sys.executable, '-m', 'servo_rig_driver.adapter.adapter_node', '--ros-args', '-p',
         'mapping:=ros2_control_joint', '-p', 'joint:=hip', '-p', 'diagnostics_period:=0.2', '-p',
         'block_size:=1', '-r', '__ns:=/back'])
    publishing = [ears.node.create_publisher(JointState, STATES, QoSProfile(depth=10))]

    def publish():
        state = JointState(name=['hip'], position=[0.0], effort=[1.0])
        while not over.wait(0.005):
            state.header.stamp = ears.node.get_clock().now().to_msg()
            publishing[0].publish(state)

    thread = Thread(target=publish)
    thread.start()
    try:
        ears.more_samples(10)
        first, publishing[0] = publishing[0], ears.node.create_publisher(
            JointState, STATES, QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT))
        ears.node.destroy_publisher(first)
        ears.more_samples(50)
    finally:
        over.set()
        thread.join()
        adapter.send_signal(signal.SIGINT)
        assert adapter.wait(60.0) == 0
        ears.close()


@pytest.mark.ros
@pytest.mark.parametrize('executor', [EventsExecutor, SingleThreadedExecutor])
def test_messages_come_with_their_numbers_in_every_executor_of_rclpy(executor):
    context, heard = Context(), []
    rclpy.init(context=context)
    try:
        node = rclpy.create_node('numbers', context=context)
        spinning = executor(context=context)
        spinning.add_node(node)
        topics = RobotTopics(node, [STATES], STATES, 1.0, RigHealth(), lambda *told: heard.append(
            told))
        talker = node.create_publisher(JointState, STATES, 10)

        def hears():
            topics.look(0)
            talker.publish(JointState(name=['hip']))
            spinning.spin_until_future_complete(Future(), 0.02)
            return len(heard) > 4
        wait_for(hears, 'messages come')
        assert {(topic, message.name[0]) for topic, message, _ in heard} == {(STATES, 'hip')}
        numbers = [number for *_, number in heard]
        assert all(after > before for before, after in pairwise(numbers)), numbers
        spinning.remove_node(node)
        node.destroy_node()
    finally:
        rclpy.try_shutdown(context=context)
