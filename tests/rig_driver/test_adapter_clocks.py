"""An adapter beside a robot whose clock is set while it runs: it ..."""

from contextlib import contextmanager
from math import isfinite
import signal
import subprocess
import sys
from threading import Event, Thread

from driver_bench import Listener, wait_for
import pytest
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

MAPPING = """
time: {source: /joint_states.stamp}
columns:
  load_position: {source: '/joint_states.position[hip]'}
  current: {source: '/motor_states.effort[hip]'}
  voltage: {source: '/motor_orders.effort[hip]'}
"""
TOPICS = ('/joint_states', '/motor_states', '/motor_orders')
APART = 0.4  # s by which the topics begin apart, as those of two nodes do


class Robot:
    """Publishes the topics at 200 Hz by a clock that is ``ahead`` of ours, s."""

    def __init__(self, node):
        self.ahead, self._over, self._node = 0.0, Event(), node
        self._publishers = [node.create_publisher(JointState, topic, QoSProfile(depth=100))
                            for topic in TOPICS]
        self._thread = Thread(target=self._publish)
        self._thread.start()

    def _publish(self):
        state, count = JointState(name=['hip'], position=[0.5], effort=[1.0]), 0
        while not self._over.wait(0.005):
            now = self._node.get_clock().now().nanoseconds + round(self.ahead * 1e9)
            state.header.stamp.sec, state.header.stamp.nanosec = divmod(now, 10**9)
            count += 1
            for place, publisher in enumerate(self._publishers):
                if count > place * APART / 0.005:
                    publisher.publish(state)

    def close(self):
        self._over.set()
        self._thread.join()


@contextmanager
def adapted(folder):
    """Give a robot, and a node that hears what an adapter makes of it."""
    (folder / 'robot.yaml').write_text(MAPPING)
    ears = Listener('clocks', commands=False)
    adapter = subprocess.Popen(
        [sys.executable, '-m', 'servo_rig_driver.adapter.adapter_node', '--ros-args', '-p',
         f'mapping:={folder / "robot.yaml"}', '-p', 'joint:=hip', '-p', 'block_size:=1',
         '-r', '__ns:=/clocks'])
    robot = Robot(ears.node)
    try:
        yield robot, ears
    finally:
        robot.close()
        adapter.send_signal(signal.SIGINT)
        assert adapter.wait(60.0) == 0
        ears.close()


def whole(messages):
    """Whether the last samples have numbers in every column."""
    return len(messages) >= 100 and all(
        isfinite(one.current[0]) and isfinite(one.voltage[0]) for one in messages[-100:])


@pytest.mark.ros
@pytest.mark.parametrize('leap', [600.0, -600.0])
def test_keeps_the_columns_of_every_topic_when_the_clock_is_set(leap, tmp_path):
    with adapted(tmp_path) as (robot, ears):
        wait_for(lambda: whole(ears.current), 'every column has numbers')
        before = len(ears.current)
        robot.ahead = leap
        wait_for(lambda: any(one.sequence < ears.current[before - 1].sequence
                             for one in ears.current[before:]), 'the samples begin again')
        wait_for(lambda: whole(ears.current), 'every column has numbers again', 15.0)
