"""A running rig as the source of the view: it ..."""

from threading import Thread
from time import sleep

import pytest
import rclpy

from servo_twin.bringup.processes import wait_until
from servo_twin.view.live_rig import LiveRig

pytestmark = pytest.mark.ros


def test_it_ends_though_its_executor_always_has_work():
    rclpy.init()
    rig, worked = LiveRig('busy'), []

    def work():
        worked.append(True)
        sleep(0.02)
    rig._node.create_timer(0.005, work)
    wait_until(lambda: len(worked) > 10, 'it works', 60.0)
    closing = Thread(target=rig.close, daemon=True)
    closing.start()
    closing.join(60.0)
    assert not closing.is_alive()
