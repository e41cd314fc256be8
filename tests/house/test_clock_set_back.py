"""Nodes go on as before when the wall clock is set back: their timers are of the steady clock."""

import os
from pathlib import Path
import subprocess
import sys

from diagnostic_msgs.msg import DiagnosticArray
from driver_bench import Listener, wait_for
import pytest
from stepped_clock import SteppedClock

SERVO = Path(__file__).resolve().parents[2] / 'config' / 'servos' / 'rv_bench.yaml'
NODES = {
    'driver': ('servo_rig_driver.driver.driver_node', 'autostart:=false'),
    'recorder': ('servo_rig_driver.record.recorder_node', 'output:=bag'),
    'twin': ('servo_twin.nodes.twin_node', f'servo_file:={SERVO}'),
    'identify': ('servo_identify.nodes.identify_node', f'servo_file:={SERVO}'),
}


@pytest.fixture
def ears():
    listener = Listener('set_back')
    yield listener
    listener.close()


@pytest.mark.long
@pytest.mark.ros
@pytest.mark.parametrize('name', NODES)
def test_its_health_is_told_after_the_clock_was_set_back_by_an_hour(name, ears, tmp_path):
    clock, said = SteppedClock(tmp_path), []
    if not clock.works:
        pytest.skip('no C compiler: the clock of a process cannot be set')
    ears.node.create_subscription(DiagnosticArray, '/diagnostics', said.append, 10)
    module, value = NODES[name]
    node = subprocess.Popen(
        [sys.executable, '-m', module, '--ros-args', '-r', '__ns:=/set_back', '-p', value],
        cwd=tmp_path, env=os.environ | clock.environment, stdout=subprocess.DEVNULL)
    try:
        wait_for(lambda: said, f'the {name} says how it does')
        clock.set(-3600.0)
        before = said[-1].header.stamp.sec
        wait_for(lambda: said[-1].header.stamp.sec < before - 3500, 'it says so by the clock set')
        count = len(said)
        wait_for(lambda: len(said) > count + 1, 'it goes on')
        node.terminate()
        assert node.wait(60.0) == 0
    finally:
        node.kill()
