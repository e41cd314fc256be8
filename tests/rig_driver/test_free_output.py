"""A node goes on though nobody takes what it says: it ..."""

import fcntl
import os
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


def test_it_ends_though_nobody_reads():
    read, write = os.pipe()
    small(write)
    process = subprocess.Popen([sys.executable, '-c', SAYS.format(lines=5000)], stderr=write)
    try:
        assert process.wait(60.0) == 0
        assert os.read(read, SIZE).startswith(b'line 00000')
    finally:
        process.kill()
        os.close(read)
        os.close(write)
