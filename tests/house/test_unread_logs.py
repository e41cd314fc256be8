"""Every node, hub and emulated rig goes on though nobody takes what it says."""

from contextlib import contextmanager
import fcntl
import os
import subprocess
import sys

from diagnostic_msgs.msg import DiagnosticArray
from drive_bench import CONFIG, Link, parameters, rig_file
from driver_bench import Listener, wait_for
import pytest
from test_shared_memory import NODES

SMALL = 4096  # bytes, the smallest pipe of Linux: less than what a node says as it starts
HEARD = 3  # times, one a second
EVERY = NODES | {'adapter': ('servo_rig_driver.adapter.adapter_node', 'mapping:=robot.yaml')}
SLOW = {'sync_period': 0.01, 'device.watchdog': 5.0}  # s, for a busy machine
MAPPING = """
time: {source: /joint_states.stamp}
columns: {load_position: {source: '/joint_states.position[hip]'}}
"""


def waits_in(pipe):
    """Return how many bytes nobody has read; the whole pipe may be taken up by few."""
    told = fcntl.ioctl(pipe, 0x541B, b'\0' * 4)  # FIONREAD
    return int.from_bytes(told, sys.byteorder)


@contextmanager
def full_pipe():
    """Give the end of a pipe that takes no more, and that nobody reads."""
    read, write = os.pipe()
    fcntl.fcntl(write, fcntl.F_SETPIPE_SZ, SMALL)
    os.write(write, bytes(SMALL))
    try:
        yield write
    finally:
        os.close(read)
        os.close(write)


@contextmanager
def unread(*command):
    """Run a module whose log nobody takes."""
    with full_pipe() as log, subprocess.Popen([sys.executable, '-m', *command], stdout=log,
                                              stderr=log) as process:
        try:
            yield process
        finally:
            process.kill()


def test_a_hub_and_an_emulated_rig_serve_though_nobody_reads_their_logs(tmp_path):
    channel, of = str(tmp_path / 'rig.can'), parameters('robstride', **SLOW)
    with unread('servo_rig_driver.can_bus.can_hub', channel) as hub, unread(
            'servo_rig_driver.emulated.rig_process', '--rig', str(rig_file('robstride')),
            '--channel', channel, '--driver', str(CONFIG / 'drivers' / 'robstride.yaml'),
            '--period', str(SLOW['sync_period'])) as rig:
        wait_for((tmp_path / 'rig.can').exists, 'the hub is there')
        link = Link(channel, of)
        try:
            link.up()
        finally:
            link.link.close()
        for process in (rig, hub):
            process.terminate()
            assert process.wait(60.0) == 0


@pytest.mark.long
@pytest.mark.ros
@pytest.mark.parametrize('name', EVERY)
def test_a_node_is_heard_though_its_log_is_full(name, tmp_path):
    module, value = EVERY[name]
    (tmp_path / 'robot.yaml').write_text(MAPPING)
    read, write = os.pipe()
    fcntl.fcntl(write, fcntl.F_SETPIPE_SZ, SMALL)
    ears, said = Listener('unread'), []
    ears.node.create_subscription(
        DiagnosticArray, '/diagnostics', lambda told: said.append(waits_in(read)), 10)
    node = subprocess.Popen(
        [sys.executable, '-m', module, '--ros-args', '-r', '__ns:=/unread', '-p', value,
         '--log-level', 'debug'], cwd=tmp_path, stdout=write, stderr=write)
    try:
        wait_for(lambda: sum(map(bool, said)) >= HEARD, f'the {name} is heard')
        node.terminate()
        node.wait(60.0)
    finally:
        node.kill()
        os.close(read)
        os.close(write)
        ears.close()
