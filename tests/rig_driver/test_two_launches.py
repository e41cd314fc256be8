"""Two launches of one bench, at once or in turn: one drives it, and nothing is left."""

import os
import signal
import subprocess
import sys

from can_watcher import CanWatcher, DISABLED, ENABLED
from driver_bench import alive, CONFIG, Listener, wait_for
from lifecycle_msgs.msg import Transition
import pytest
from test_driver_lifecycle import Hands
from test_safe_end import EMULATOR, HEARTBEAT, HUB, LAUNCHER

pytestmark = [pytest.mark.ros, pytest.mark.long]

NAMES = ('hub', 'rig', 'driver', 'twin')
HELD = 'then deactivate and activate the driver'  # what a driver says that keeps its drive down


class Launch:
    """A launch of the bench at its channel; ``said`` is the log of all its processes."""

    def __init__(self, channel, log, namespace='pair'):
        node, named = f'{sys.executable} -m', f'--ros-args -r __ns:=/{namespace}'
        commands = [
            ' '.join([*HUB, channel]), ' '.join([*EMULATOR, channel]),
            f'{node} servo_rig_driver.driver.driver_node {named} --params-file {CONFIG} '
            f'-p bus.channel:={channel} -p autostart:=true -p block_size:=10 '
            f'-p sync_period:=0.002 -p heartbeat_timeout:={HEARTBEAT} -p retry_period:=0.1',
            f'{node} servo_twin.nodes.twin_node {named} -p autostart:=true']
        self.log, self.namespace, self.activated = log, namespace, 0
        with log.open('w') as told:
            self.process = subprocess.Popen(
                [sys.executable, '-c', LAUNCHER, *commands], text=True, stdout=subprocess.PIPE,
                stderr=told, start_new_session=True)
        self.pids = dict(zip(NAMES, map(int, self.process.stdout.readline().split()),
                             strict=True))

    def runs(self, name):
        return alive(self.pids[name])

    @property
    def said(self):
        return self.log.read_text()

    def activate(self):
        """Activate a driver that keeps its drive down until somebody does, once each time."""
        held = self.said.count(HELD)
        if held == self.activated:
            return
        self.activated = held
        ears = Listener(self.namespace, commands=False)
        try:
            for change in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVATE):
                assert Hands(ears).change(change)
        finally:
            ears.close()

    def send(self, number):
        os.killpg(self.process.pid, number)

    def close(self):
        for pid in [*self.pids.values(), self.process.pid]:
            if alive(pid):
                os.kill(pid, signal.SIGKILL)
        self.process.wait()


@pytest.fixture
def launches(tmp_path):
    """Launch the bench, each time into a log of its own, and end all of it afterwards."""
    begun = []

    def launch(namespace='pair'):
        begun.append(Launch(str(tmp_path / 'rig.can'), tmp_path / f'{len(begun)}.log', namespace))
        return begun[-1]
    yield launch
    for one in begun:
        one.close()


def ends_without_torque(watcher, *ended):
    """End launches that run, and check that the drive went down and that nobody is left."""
    for one in ended:
        one.send(signal.SIGINT)
    wait_for(lambda: watcher.states[-1:] == [DISABLED], 'the drive has no torque')
    watcher.close()
    wait_for(lambda: not any(one.runs(name) for one in ended for name in NAMES), 'all have ended')


@pytest.mark.parametrize('names', [('pair', 'pair'), ('left', 'right')])
def test_of_two_at_once_one_drives_and_the_other_says_why_it_does_not(launches, tmp_path, names):
    both = [launches(name) for name in names]
    watcher = CanWatcher(str(tmp_path / 'rig.can'))
    wait_for(lambda: all(sum(one.runs(name) for one in both) == 1 for name in ('hub', 'rig')),
             'one bus and one rig are left')
    if len(set(names)) == 1:
        for node in ('driver', 'twin'):
            wait_for(lambda node=node: sum(one.runs(node) for one in both) == 1,
                     f'one {node} has given way')
            assert any(f'another /pair/{node} runs' in one.said for one in both)
    else:
        wait_for(lambda: any('another driver is on this bus' in one.said for one in both),
                 'one driver says that another one is there')

    def drives():  # both rigs speak for a moment on a busy machine: to a driver, a drive went down
        for one in both:
            one.activate()
        return watcher.states[-1:] == [ENABLED]
    wait_for(drives, 'one drives')
    ends_without_torque(watcher, *both)


def test_one_that_was_killed_is_launched_again_at_once(launches, tmp_path):
    before = launches()
    watcher = CanWatcher(str(tmp_path / 'rig.can'))
    wait_for(lambda: watcher.states[-1:] == [ENABLED], 'the drive is enabled')
    watcher.close()
    before.send(signal.SIGKILL)
    again = launches()
    watcher = CanWatcher(str(tmp_path / 'rig.can'))
    wait_for(lambda: watcher.states[-1:] == [ENABLED], 'the drive is enabled again')
    assert all(again.runs(name) for name in NAMES), again.said
    ends_without_torque(watcher, again)
