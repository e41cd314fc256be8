"""An identify node beside a twin whose servo others change: it ..."""

from contextlib import contextmanager
import subprocess
import sys

import pytest
from rclpy.action import ActionClient
from twin_graph import graph, servo_files

from servo_twin.bringup.processes import wait_until
from servo_twin.description.servo_file import load
from servo_twin_msgs.action import Diagnose
from servo_twin_msgs.srv import LoadServo

__all__ = ['graph', 'servo_files']

WAITS = 20.0  # s; what the twin says is there at once


@contextmanager
def identifying(rig, folder):
    """Run an identify node beside a twin; give what returns the servo that it would diagnose."""
    node = subprocess.Popen(
        [sys.executable, '-m', 'servo_identify.nodes.identify_node', '--ros-args', '-r',
         f'__ns:=/{rig.name}', '-p', 'servo_file:=rv_plain', '-p', f'folder:={folder}'])
    client = ActionClient(rig.node, Diagnose, f'/{rig.name}/diagnose')

    def diagnosed():
        sent = client.send_goal_async(Diagnose.Goal())
        rig.wait(sent.done)
        answered = sent.result().get_result_async()
        rig.wait(answered.done)
        assert not answered.result().result.success  # there are no samples
        last = max(folder.glob('diagnose_*'), key=lambda one: int(one.name.split('_')[1]))
        return load(last / 'running.yaml')
    try:
        rig.wait(client.server_is_ready)
        yield diagnosed
    finally:
        client.destroy()
        node.terminate()
        assert node.wait(60.0) == 0


@pytest.mark.long
@pytest.mark.ros
def test_it_diagnoses_the_servo_that_the_twin_runs_whoever_has_loaded_or_changed_it(
        graph, servo_files, tmp_path):
    rig = graph('followed').ready()
    with identifying(rig, tmp_path) as diagnosed:
        wait_until(lambda: diagnosed().name == 'bench',  # its own file is of another machine
                   'the servo of the twin is known', WAITS)
        assert rig.ask(LoadServo, 'twin/load_servo', LoadServo.Request(
            path=str(servo_files / 'other.yaml'))).success
        wait_until(lambda: diagnosed().name == 'other', 'the other one is known', WAITS)
        assert rig.set('drive.gain', 0.45).successful
        wait_until(lambda: diagnosed().values['drive.gain'] == 0.45, 'the value is known', WAITS)
        assert diagnosed().values.keys() == load(servo_files / 'other.yaml').values.keys()
