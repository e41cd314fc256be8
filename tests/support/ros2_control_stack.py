"""
A robot under its own position controller, as ros2_control shows one: JointState at 500 Hz.

``python ros2_control_stack.py SECONDS [key=value ...]`` moves the joints hip and knee. Nobody has
access to its drives. ``clock`` s is added to its stamps, as of another machine; ``lose`` is the
share of messages that are not sent; ``gravity`` N m acts on the hip; ``still`` s it waits. Stamps
are those of its loop, whose period is as uneven as this machine makes it.

Each joint: inertia 0.5 kg m2, viscous 0.8 N m s/rad, Coulomb friction 0.6 N m; its effort is what
the motor delivers at the joint, N m. It shares nothing with the twin.
"""

from math import copysign, pi, sin
import random
import sys
import time

import rclpy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

PERIOD = 2e-3
STEPS = 8
JOINTS = ('hip', 'knee')
INERTIA, VISCOUS, COULOMB = 0.5, 0.8, 0.6


class Joint:
    """One joint and its controller: a PD law of the angle with a limit."""

    def __init__(self, gravity: float, pace: float) -> None:
        self.gravity, self.pace = gravity, pace
        self.angle = self.speed = self.effort = self.reference = 0.0

    def control(self, now: float) -> None:
        """Take the reference of an instant, s, and set the effort that holds to the next one."""
        w = 2.0 * pi * self.pace
        fade = min(1.0, now / 2.0)
        self.reference = fade * (0.8 * sin(w * now) + 0.3 * sin(2.7 * w * now))
        self.effort = max(-60.0, min(60.0, 120.0 * (self.reference - self.angle)
                                     - 12.0 * self.speed))

    def move(self, seconds: float) -> None:
        """Integrate the motion under the held effort."""
        h = seconds / STEPS
        for _ in range(STEPS):
            torque = self.effort - VISCOUS * self.speed - self.gravity * sin(self.angle)
            after = self.speed + h * torque / INERTIA
            loss = h * COULOMB / INERTIA
            self.speed = 0.0 if abs(after) <= loss else after - copysign(loss, after)
            self.angle += h * self.speed


def main(seconds: float, clock: float = 0.0, lose: float = 0.0, gravity: float = 0.0,
         still: float = 0.0) -> None:
    """Run in real time."""
    rclpy.init()
    node = rclpy.create_node('controller_manager')
    states = node.create_publisher(JointState, '/joint_states', QoSProfile(depth=1000))
    commands = node.create_publisher(Float64MultiArray, '/position_controller/commands', 100)
    chance = random.Random(1)
    joints = [Joint(gravity, 0.35), Joint(0.0, 0.5)]
    message = JointState(name=list(JOINTS))
    time.sleep(still)
    begin = last = time.monotonic()
    zero = time.time_ns() - time.monotonic_ns()
    k = 0
    while last - begin < seconds:
        k += 1
        time.sleep(max(0.0, begin + k * PERIOD - time.monotonic()))
        now = time.monotonic()
        for joint in joints:
            joint.move(now - last)
            joint.control(now - begin)
        last = now
        stamp = round((now + clock) * 1e9) + zero
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        message.position = [j.angle + chance.gauss(0.0, 2e-5) for j in joints]
        message.velocity = [j.speed for j in joints]
        message.effort = [j.effort for j in joints]
        if chance.random() >= lose:
            states.publish(message)
        if k % 10 == 1:
            commands.publish(Float64MultiArray(data=[j.reference for j in joints]))
        if now - begin > (k + 50) * PERIOD:  # it was held up: no hundred loops at once
            k = round((now - begin) / PERIOD)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main(float(sys.argv[1]), **{key: float(value) for key, value in (
        word.split('=') for word in sys.argv[2:])})
