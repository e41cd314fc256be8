"""
Publishes numbered samples on encoder, torque and current at an even rate, as a program.

``python sample_source.py BLOCKS RATE BLOCK_SIZE [SKIPPED BLOCK ...]``: waits for a subscriber on
each topic, sends, waits until all is acknowledged. Every column holds the sample's number.
"""

from array import array
import sys
import time

import rclpy
from rclpy.duration import Duration
from rclpy.qos import QoSProfile

from servo_twin_msgs.msg import Current, Encoder, Torque


def main(blocks: int, rate: float, size: int, skipped: set[int]) -> None:
    """Publish ``blocks`` blocks of ``size`` samples at ``rate`` samples a second."""
    rclpy.init()
    node = rclpy.create_node('sample_source')
    kinds = {'encoder': Encoder, 'torque': Torque, 'current': Current}
    publishers = [node.create_publisher(kind, topic, QoSProfile(depth=5000))
                  for topic, kind in kinds.items()]
    fields = [list(kind.get_fields_and_field_types())[3:] for kind in kinds.values()]
    deadline = time.monotonic() + 30.0
    while any(publisher.get_subscription_count() < 1 for publisher in publishers):
        assert time.monotonic() < deadline, 'nobody listens'
        time.sleep(0.01)
    begin, start = time.monotonic(), time.time_ns()
    for block in range(blocks):
        while (pause := begin + block * size / rate - time.monotonic()) > 0.0:
            time.sleep(pause)
        if block in skipped:
            continue
        numbers = array('d', range(block * size, (block + 1) * size))
        stamp = divmod(start + round(block * size / rate * 1e9), 10**9)
        for publisher, kind, names in zip(publishers, kinds.values(), fields, strict=True):
            message = kind(sequence=block * size, period=1.0 / rate,
                           **{name: numbers for name in names})
            message.header.stamp.sec, message.header.stamp.nanosec = stamp
            message.header.frame_id = 'rig'
            publisher.publish(message)
    for publisher in publishers:
        publisher.wait_for_all_acked(Duration(seconds=10))
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main(int(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]), set(map(int, sys.argv[4:])))
