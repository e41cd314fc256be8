"""A run after one that was killed: DDS keeps a killed process for 20 s, and the run knows it."""

import os
import signal
import subprocess
import sys
from time import sleep

import pytest

from servo_twin.bringup.own_namespace import AT_FIRST, look_around, outlast
from servo_twin.bringup.processes import ProcessError, Processes
from servo_twin.nodes.ended_processes import ended
from servo_twin.nodes.session_node import EVERYBODYS, Session

DRIVER = """
import rclpy
from servo_twin_msgs.msg import Command
rclpy.init()
node = rclpy.create_node('driver', namespace='killed')
node.create_publisher(Command, 'command', 10)
print('there', flush=True)
rclpy.spin(node)
"""


def gid(pid, vendor=b'\x01\x0f', host=b'\xab\xcd'):
    return list(vendor + host + (pid & 0xFFFF).to_bytes(2, 'little') + bytes(10))


def test_a_process_that_has_ended_is_known_by_the_identifiers_of_its_endpoints():
    own = gid(os.getpid())
    child = subprocess.Popen([sys.executable, '-c', 'input()'], stdin=subprocess.PIPE)
    theirs = gid(child.pid)
    assert not ended(theirs, own) and not ended(own, own)
    child.kill()
    while not ended(theirs, own):  # also while nobody has waited for it
        sleep(0.01)
    child.wait()
    assert ended(theirs, own)
    assert not ended(gid(child.pid, host=b'\xab\xce'), own)  # another machine
    assert not ended(gid(child.pid, vendor=b'\x01\x10'), gid(0, vendor=b'\x01\x10'))
    assert not ended(theirs, [])


@pytest.mark.long
@pytest.mark.ros
def test_a_run_refuses_one_that_runs_and_outlasts_one_that_was_killed(tmp_path):
    said = []
    there = subprocess.Popen([sys.executable, '-c', DRIVER], stdout=subprocess.PIPE, text=True)
    try:
        assert there.stdout.readline() == 'there\n'
        with Processes(tmp_path) as none, Session('killed') as session:
            with pytest.raises(ProcessError, match='driver runs; command is published by /killed'):
                look_around(session, 60.0, none)
            outlast(session, none, said.append)
            assert said == []
            there.send_signal(signal.SIGKILL)
            there.wait()
            assert session.killed(EVERYBODYS) == ['driver'] == session.killed('command')
            look_around(session, AT_FIRST, none)
            outlast(session, none, said.append)
            assert 'forgotten driver, which was killed' in said[0]
            assert 'driver' not in session.nodes() and not session.publishers('command')
    finally:
        there.kill()
