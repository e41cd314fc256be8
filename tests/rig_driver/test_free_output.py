"""A node goes on though nobody takes what it says: it ..."""

import fcntl
import os
import select
import signal
import subprocess
import sys

from driver_bench import DriverProcess, Listener, wait_for
from lifecycle_msgs.msg import Transition
import pytest
from scripted_rig import DISABLED, ENABLED, ScriptedRig
from test_driver_lifecycle import Hands

from servo_rig_driver.can_bus.can_hub import CanHub

SIZE = 4096  # bytes, the smallest pipe of Linux
SAYS = """
import os, sys
from servo_rig_driver.free_output import free_output
free_output()
for k in range({lines}):
    print(f'line {{k:05d}}', file=sys.stderr)
os.write(2, b'done')
"""


def small(pipe):
    fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, SIZE)


@pytest.mark.long
@pytest.mark.ros
def test_a_driver_samples_and_is_deactivated_though_nobody_reads_its_log(tmp_path):
    channel = str(tmp_path / 'rig.can')
    with CanHub(channel), ScriptedRig(channel) as rig:
        ears = Listener('unread')
        driver = DriverProcess('unread', bus__channel=channel, block_size=10, sync_period=0.002,
                               listen_time=0.05)
        try:
            small(driver.process.stdout)
            wait_for(lambda: rig.status == ENABLED and ears.encoder, 'the drive is enabled')
            hands = Hands(ears)
            for k in range(60):  # each is limited, and told in a line of its own
                ears.command(3, [100.0 + k], ears.now())
                ears.more_samples(6)
            assert hands.change(Transition.TRANSITION_DEACTIVATE)
            wait_for(lambda: rig.status == DISABLED, 'the drive has no torque')
        finally:
            said = driver.close()
            ears.close()
        assert driver.process.returncode == 0
        assert len(said) > SIZE  # what waited is there for who reads later


@pytest.mark.parametrize('lines', [3, 20_000])
def test_it_says_all_up_to_its_end_to_who_reads(lines):
    told = subprocess.run([sys.executable, '-c', SAYS.format(lines=lines)], capture_output=True,
                          text=True, timeout=60.0)
    assert told.returncode == 0
    assert told.stderr.splitlines() == [f'line {k:05d}' for k in range(lines)] + ['done']


@pytest.mark.parametrize('how', ['os.abort()', 'os.kill(os.getpid(), 9)'])
@pytest.mark.parametrize('lines', [1, 1500])
def test_what_it_said_before_it_aborts_or_is_killed_reaches_who_reads(lines, how):
    said = subprocess.run([sys.executable, '-c', SAYS.format(lines=lines) + how],
                          capture_output=True, text=True, timeout=60.0)
    assert said.returncode in (-signal.SIGABRT, -signal.SIGKILL)
    assert said.stderr.splitlines() == [f'line {k:05d}' for k in range(lines)] + ['done']


def test_its_lines_keep_their_order_where_both_outputs_are_one():
    says = SAYS.format(lines=0) + """
for k in range(200):
    os.write(1 + k % 2, b'%d ' % k)
"""
    said = subprocess.run([sys.executable, '-c', says], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=60.0)
    assert said.stdout == 'done' + ''.join(f'{k} ' for k in range(200))


@pytest.mark.parametrize('how', ['', 'os.kill(os.getpid(), 9)'])
def test_nobody_is_left_though_nobody_reads(how):
    read, write = os.pipe()
    small(write)
    ended = select.poll()
    ended.register(read, 0)  # POLLHUP: nobody holds the other end
    with subprocess.Popen([sys.executable, '-c', SAYS.format(lines=5000) + how],
                          stderr=write) as process:
        os.close(write)
        try:
            assert process.wait(60.0) == (-signal.SIGKILL if how else 0)
            assert ended.poll(60_000.0)
            assert os.read(read, SIZE).startswith(b'line 00000')
        finally:
            process.kill()
            os.close(read)
