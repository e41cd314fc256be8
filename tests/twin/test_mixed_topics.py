"""Topics that several nodes publish: the twin says whose samples and answers are mixed."""

import pytest
import rclpy

from servo_twin_msgs.msg import Encoder, Prediction

pytestmark = pytest.mark.ros


def test_it_names_the_nodes_that_publish_what_one_alone_should(graph):
    rig = graph('rig').ready()
    assert 'published' not in rig.told[-1].message
    stray = rclpy.create_node('stray', namespace='/rig')
    stray.create_publisher(Encoder, 'encoder', 10)
    stray.create_publisher(Prediction, 'twin/prediction', 10)
    rig.wait(lambda: "encoder is published by ['/feeder', '/rig/stray'], twin/prediction is "
             "published by ['/rig/stray', '/rig/twin']" in rig.told[-1].message)
    assert rig.told[-1].level >= b'\x01'
    stray.destroy_node()
    rig.wait(lambda: 'published' not in rig.told[-1].message)
