"""One recorder for two rigs, in the namespace of one of them: it ..."""

from array import array
import signal
import subprocess
import sys
import time

from driver_bench import Listener, wait_for
import pytest
from rclpy.qos import QoSProfile

from servo_twin.bag import read_recording
from servo_twin.nodes.message_conversion import to_time, TOPICS

RIGS = ('left', 'right')


@pytest.mark.ros
def test_gives_the_servo_file_to_its_own_rig_and_none_to_the_other(tmp_path):
    bag = tmp_path / 'bag'
    wanted = [f'/{rig}/{topic}:servo_twin_msgs/msg/{kind.__name__}'
              for rig in RIGS for topic, kind in TOPICS.items()]
    ears = Listener('right', commands=False)
    recorder = subprocess.Popen(
        [sys.executable, '-m', 'servo_rig_driver.record.recorder_node', '--ros-args', '-r',
         '__ns:=/right', '-p', f'output:={bag}', '-p', 'servo_file:=rv_plain', '-p',
         f'topics:=[{", ".join(map(repr, wanted))}]'])
    try:
        publishers = {(rig, topic): ears.node.create_publisher(
            kind, f'/{rig}/{topic}', QoSProfile(depth=1000))
            for rig in RIGS for topic, kind in TOPICS.items()}
        wait_for(lambda: all(one.get_subscription_count() for (rig, _), one in publishers.items()
                             if rig == 'left'), 'the recorder hears the left rig')
        wait_for(lambda: all(one.get_subscription_count() > 1 for (rig, _), one in
                             publishers.items() if rig == 'right'), 'and the right one')
        zeros, start = array('d', bytes(80)), time.time_ns()
        for k in range(50):
            for (_, topic), publisher in publishers.items():
                fields = TOPICS[topic].get_fields_and_field_types()
                message = TOPICS[topic](sequence=10 * k, period=1e-3, **{
                    name: zeros for name, kind in fields.items() if kind == 'sequence<double>'})
                message.header.stamp = to_time(start + k * 10**7)
                publisher.publish(message)
            time.sleep(0.01)
        wait_for(lambda: len(ears.encoder) == 50, 'all was heard')
    finally:
        recorder.send_signal(signal.SIGINT)
        assert recorder.wait(60.0) == 0
        ears.close()
    left, right = (read_recording(bag, rig) for rig in RIGS)
    assert (right.servo, left.servo, left.servo_file) == ('rv_plain', '', '')
    assert any('no message on /left/recording' in warning for warning in left.warnings)
