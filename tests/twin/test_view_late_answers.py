"""The live view outlives a twin that hangs while the page sets a value."""

import asyncio
import signal

import pytest
import rclpy

from servo_twin.bringup.processes import wait_until
from servo_twin.view import live_rig
from servo_twin.view.source import Refused

pytestmark = [pytest.mark.ros, pytest.mark.slow]
PATH = 'effects.bearing.level'


def test_an_answer_that_comes_too_late_ends_nothing(graph, monkeypatch):
    twin = graph('rig').ready()
    rig = live_rig.LiveRig('rig')

    def value():
        return next((one['value'] for one in rig._values.listed() if one['path'] == PATH), None)

    try:
        wait_until(lambda: value() is not None, 'the twin has told its values', 60.0)
        before = value()
        twin.process.send_signal(signal.SIGSTOP)
        monkeypatch.setattr(live_rig, '_ANSWERS', 0.2)
        with pytest.raises(Refused, match='the twin did not answer within 0.2 s'):
            asyncio.run(rig.set_value(PATH, before + 1.0))
        twin.process.send_signal(signal.SIGCONT)
        wait_until(lambda: value() == before + 1.0, 'the late answer has come', 60.0)
        monkeypatch.setattr(live_rig, '_ANSWERS', 60.0)
        asyncio.run(rig.set_value(PATH, before))
        wait_until(lambda: value() == before, 'the view goes on', 60.0)
    finally:
        twin.process.send_signal(signal.SIGCONT)
        with monkeypatch.context() as patched:
            patched.setattr(rclpy, 'try_shutdown', lambda: None)  # the graph still needs it
            rig.close()
