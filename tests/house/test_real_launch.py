"""The launch files under ROS's own launch: what it starts runs, and ends with it; else skipped."""

import os
from pathlib import Path
import signal
import subprocess
import sys
from time import monotonic, sleep

from can_watcher import CanWatcher, DISABLED, ENABLED
from driver_bench import Listener, wait_for
import pytest

from servo_twin.bag import read_predictions, read_recording
from servo_twin_msgs.msg import Prediction

WHY = "ROS's launch is not installed here (its wheels do not exist); a full Jazzy has it"
for _needed in ('launch.launch_service', 'launch_ros.actions', 'launch_yaml'):
    pytest.importorskip(_needed, reason=WHY)
pytestmark = [pytest.mark.ros, pytest.mark.slow]

LAUNCHER = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
service = LaunchService(argv=sys.argv[2:])
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    AnyLaunchDescriptionSource(sys.argv[1]),
    launch_arguments=[word.split(':=', 1) for word in sys.argv[2:]])]))
sys.exit(service.run())
"""
ROOT = Path(__file__).resolve().parents[2]
STACK = ROOT / 'tests' / 'support' / 'ros2_control_stack.py'


def children(pid):
    """Return the ids of all processes below one."""
    found = []
    for task in Path(f'/proc/{pid}/task').iterdir():
        for child in (task / 'children').read_text().split():
            found += [int(child), *children(child)]
    return found


def nodes(pids):
    """Return the processes without those that hand on what a node says."""
    return [pid for pid in pids if b'free_output.py' not in Path(
        f'/proc/{pid}/cmdline').read_bytes()]


def alive(pid):
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
    except OSError:
        return False


class Launched:
    """A launch file that runs, with a listener to its rig and a watcher of its bus."""

    def __init__(self, package, file, folder, namespace, *arguments):
        self.log = (folder / 'launch.log').open('w+')
        self.channel = str(folder / 'rig.can')
        self.process = subprocess.Popen(
            [sys.executable, '-c', LAUNCHER, str(ROOT / 'src' / package / 'launch' / file),
             f'bus:={self.channel}', f'namespace:={namespace}', *arguments],
            stdout=self.log, stderr=subprocess.STDOUT, start_new_session=True,
            env=os.environ | {'ROS_LOG_DIR': str(folder / 'log')})
        self.ears, self.watcher, self.pids = Listener(namespace), CanWatcher(self.channel), []
        self.predictions = []
        self.ears.node.create_subscription(Prediction, 'twin/prediction', self.predictions.append,
                                           1000)

    def text(self):
        self.log.seek(0)
        return self.log.read()

    def close(self):
        self.watcher.close()
        self.ears.close()
        for pid in [*self.pids, self.process.pid]:
            if alive(pid):
                os.kill(pid, signal.SIGKILL)
        self.process.wait()
        self.log.close()


@pytest.mark.parametrize('end', ['interrupted twice', 'killed'])
def test_what_it_starts_runs_and_ends_with_it(tmp_path, end):
    bag = tmp_path / 'bag'
    run = Launched('servo_twin', 'twin.launch.yaml', tmp_path, 'launched', f'record:={bag}',
                   'servo:=rv_plain', 'rig:=rv_plain')
    try:
        wait_for(lambda: run.watcher.states[-1:] == [ENABLED], 'the drive is enabled', 90.0)
        wait_for(lambda: len(run.predictions) > 50, 'the twin answers', 60.0)
        run.pids = children(run.process.pid)
        assert len(nodes(run.pids)) == 5
        run.watcher.states.clear()
        since = monotonic()
        if end == 'killed':
            run.process.kill()
        else:
            os.killpg(run.process.pid, signal.SIGINT)
            sleep(0.05)
            os.killpg(run.process.pid, signal.SIGINT)
        wait_for(lambda: DISABLED in run.watcher.states, 'the drive is down')
        assert monotonic() - since < 3.0
        run.watcher.close()
        run.process.wait(60.0)
        wait_for(lambda: not any(map(alive, run.pids)), 'all that it started has ended')
        said = run.text()
        assert 'Traceback' not in said and 'error_already_set' not in said, said
        if end != 'killed':
            assert said.count('process has finished cleanly') == 5, said
    finally:
        run.close()
    recording = read_recording(bag)
    assert (recording.servo, len(recording) > 500) == ('rv_plain', True)
    assert len(read_predictions(bag)) > 100


def test_beside_a_real_drive_nothing_is_switched_on_by_itself(tmp_path):
    from servo_rig_driver.can_bus.can_hub import CanHub
    driver = tmp_path / 'driver.yaml'
    channel = str(tmp_path / 'rig.can')
    driver.write_text((ROOT / 'config' / 'driver.yaml').read_text().replace(
        '/tmp/servo_rig.can', channel))
    with CanHub(channel):
        run = Launched('servo_rig_driver', 'rig.launch.yaml', tmp_path, 'real', 'emulator:=false',
                       f'driver:={driver}')
        try:
            said = run.ears.hears('bus', 'the bus is not open: the driver is not configured')
            assert said.level == b'\x02'
            sleep(1.0)
            assert not run.watcher.managed and not run.watcher.controls and not run.ears.encoder
            run.pids = children(run.process.pid)
            assert len(nodes(run.pids)) == 1
            os.killpg(run.process.pid, signal.SIGINT)
            run.process.wait(60.0)
        finally:
            run.close()


def test_a_list_of_joints_gives_an_adapter_a_twin_and_a_bag_for_each(tmp_path):
    ears = {joint: Listener(f'robot/{joint}') for joint in ('hip', 'knee')}
    log = (tmp_path / 'launch.log').open('w+')
    stack = subprocess.Popen([sys.executable, STACK, '60', 'gravity=3.0'])
    process = subprocess.Popen(
        [sys.executable, '-c', LAUNCHER, str(ROOT / 'src/servo_twin/launch/joints.launch.py'),
         'joints:=[hip, knee]', 'namespace:=robot', f'record:={tmp_path / "bags"}'], stdout=log,
        stderr=subprocess.STDOUT, start_new_session=True, env=os.environ | {
            'ROS_LOG_DIR': str(tmp_path / 'log')})
    try:
        heard = {joint: [] for joint in ears}
        for joint, one in ears.items():
            one.node.create_subscription(Prediction, 'twin/prediction', heard[joint].append, 100)
        wait_for(lambda: all(len(some) > 50 for some in heard.values()), 'both twins answer', 90.0)
        pids = children(process.pid)
        assert len(nodes(pids)) == 6
        os.killpg(process.pid, signal.SIGINT)
        process.wait(60.0)
        wait_for(lambda: not any(map(alive, pids)), 'all that it started has ended')
        log.seek(0)
        said = log.read()
        assert said.count('process has finished cleanly') == 6 and 'Traceback' not in said, said
    finally:
        process.kill()
        stack.terminate()
        for one in ears.values():
            one.close()
        log.close()
    for joint in ears:
        assert len(read_predictions(tmp_path / 'bags' / joint)) > 100
