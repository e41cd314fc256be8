"""
Latency, loss and CPU share of the adapter beside an emulated ros2_control robot at 500 Hz.

    python tests/benchmarks/bench_adapter.py                10 samples a message, 30 s
    python tests/benchmarks/bench_adapter.py --block 1

Latency is from the stamp of the last sample in a message to its receipt here, over two hops of
ROS. By design a sample waits for the robot's next message when it falls between two.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import signal
import subprocess
import sys
from time import time_ns

from bench_chain_driver import cpu_seconds, start
import numpy as np
import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.qos import QoSProfile
from rclpy.task import Future

from servo_rig_driver.ros_start import udp_alone
from servo_twin_msgs.msg import Encoder

ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--block', type=int, default=10, help='samples a message')
    parser.add_argument('--seconds', type=float, default=30.0)
    asked = parser.parse_args()
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.update(udp_alone(os.environ))
    rclpy.init()
    node = rclpy.create_node('reader', namespace='hip')
    executor = EventsExecutor()
    executor.add_node(node)
    heard: list[tuple[int, int, float]] = []

    def take(message: Encoder) -> None:
        stamp, size = message.header.stamp, len(message.motor_position)
        last = stamp.sec * 10**9 + stamp.nanosec + round((size - 1) * message.period * 1e9)
        heard.append((message.sequence, size, (time_ns() - last) * 1e-3))

    node.create_subscription(Encoder, 'encoder', take, QoSProfile(depth=5000))
    mapping = ROOT / 'config/imports/ros2_control_joint.yaml'
    adapter = start('servo_rig_driver.adapter.adapter_node', '--ros-args', '-r', '__ns:=/hip',
                    '-p', f'mapping:={mapping}', '-p', 'joint:=hip',
                    '-p', f'block_size:={asked.block}')
    robot = subprocess.Popen([sys.executable, ROOT / 'tests/support/ros2_control_stack.py',
                              str(asked.seconds + 60.0)])
    try:
        while len(heard) < 500 / asked.block:
            executor.spin_until_future_complete(Future(), 0.2)
        heard.clear()
        before = cpu_seconds(adapter.pid)
        executor.spin_until_future_complete(Future(), asked.seconds)
        share = (cpu_seconds(adapter.pid) - before) / asked.seconds
    finally:
        robot.kill()
        adapter.send_signal(signal.SIGTERM)
        adapter.wait(20.0)
        node.destroy_node()
        rclpy.try_shutdown()
    late = np.array([one[2] for one in heard])
    samples = sum(one[1] for one in heard)
    span = heard[-1][0] + heard[-1][1] - heard[0][0]
    middle, p99 = np.percentile(late, [50, 99])
    print(f'{asked.block} a message, {asked.seconds:g} s, load {os.getloadavg()[0]:.1f}: '
          f'{samples} samples, {span - samples} left out; latency, us: median {middle:.0f}, '
          f'p99 {p99:.0f}, max {late.max():.0f}; CPU {100 * share:.0f} % of a core')
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
