"""The identify node by itself, without rig and twin: it ..."""

from contextlib import contextmanager
import subprocess
import sys
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray
import pytest
import rclpy
from rclpy.action import ActionClient

from servo_twin.description.shipped import servo_at
from servo_twin.nodes.topic_qos import EVENTS
from servo_twin.recording.events import SERVO_FILE
from servo_twin_msgs.action import Diagnose, Retrain
from servo_twin_msgs.msg import Event, Residual

pytestmark = pytest.mark.ros
WAITS = 60.0  # s
NODE = [sys.executable, '-m', 'servo_identify.nodes.identify_node', '--ros-args', '-r',
        '__ns:=/alone', '-p', 'servo_file:=rv_plain']


@pytest.mark.parametrize(('given', 'why'), [
    ('{}/file', 'is a file; name a folder'), ('{}/file/below', 'nothing can be written there'),
    ('/proc/learned', 'nothing can be written there'), ('~nobody_here/x', 'no such user')])
def test_it_refuses_a_folder_that_nothing_can_be_written_into_at_its_start(given, why, tmp_path):
    (tmp_path / 'file').touch()
    folder = given.format(tmp_path)
    ended = subprocess.run([*NODE, '-p', f'folder:={folder}'], capture_output=True, text=True,
                           timeout=WAITS)
    assert ended.returncode == 2
    assert f"identify_node: folder = '{folder}' is where retrained" in ended.stderr
    assert why in ended.stderr and 'Traceback' not in ended.stderr


class Beside:
    """A tester beside an identify node that runs."""

    def __init__(self):
        self.node = rclpy.create_node('tester', namespace='alone')
        self.said = {}
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 10)

    def _hear(self, message):
        self.said |= {one.name.rpartition(' ')[2]: one.message for one in message.status
                      if one.name.startswith('/alone/identify')}

    def wait(self, condition):
        until = monotonic() + WAITS
        while not condition():
            assert monotonic() < until, self.said
            rclpy.spin_once(self.node, timeout_sec=0.1)

    def asked(self, action, name, goal):
        """Return what an action answers to a goal."""
        client = ActionClient(self.node, action, name)
        self.wait(client.server_is_ready)
        sent = client.send_goal_async(goal)
        self.wait(sent.done)
        answered = sent.result().get_result_async()
        self.wait(answered.done)
        client.destroy()
        return answered.result().result


@contextmanager
def running(*settings):
    """Run the node; give a tester beside it."""
    words = [word for one in settings for word in ('-p', one)]
    rclpy.init()
    process = subprocess.Popen([*NODE, *words])
    try:
        yield Beside()
    finally:
        process.terminate()
        rclpy.try_shutdown()
        assert process.wait(60.0) == 0


def test_it_refuses_a_goal_at_once_whose_folder_has_become_none(tmp_path):
    folder = tmp_path / 'learned'
    with running(f'folder:={folder}') as beside:
        beside.wait(lambda: 'models' in beside.said)
        other = beside.asked(Diagnose, 'diagnose', Diagnose.Goal(output='/proc/report',
                                                                 bags=['bag']))
        assert '/proc/report: nothing can be written there' in other.message
        for one in folder.glob('*/*'):
            one.unlink()
        for one in folder.iterdir():
            one.rmdir()
        folder.rmdir()
        folder.touch()
        for action, name in ((Retrain, 'retrain'), (Diagnose, 'diagnose')):
            answer = beside.asked(action, name, action.Goal())
            assert not answer.success
            assert f'{folder}/{name}_' in answer.message
            assert 'nothing can be written there (Not a directory)' in answer.message


def test_it_learns_again_once_the_twin_says_that_it_was_given_a_servo_file():
    with running() as beside:
        residuals = beside.node.create_publisher(Residual, 'twin/residual', 5000)
        events = beside.node.create_publisher(Event, 'events', EVENTS)
        beside.wait(lambda: residuals.get_subscription_count() == 1
                    and beside.said.get('changes') == 'no residuals came')
        residuals.publish(Residual(sequence=0, period=0.001))
        beside.wait(lambda: beside.said['changes'].startswith('learning what is usual'))
        events.publish(Event(source='/alone/twin', kind=SERVO_FILE,
                             content=servo_at('rv_plain').read_text()))
        beside.wait(lambda: beside.said['changes'] == 'no residuals came')


@pytest.mark.slow
@pytest.mark.parametrize(('settings', 'said'), [
    ([], 'the twin /alone/other runs, and this node follows /alone/twin, which is not there: what '
     '/alone/other runs is not known here; start this node with -p twin:=/alone/other'),
    (['twin:=other'], 'the twin runs a servo file, or values, that were not loaded from here'),
    (['twin:=/alone/other'], 'the twin runs a servo file, or values, that were not loaded from '
     'here')])
def test_it_follows_a_twin_of_another_name_or_says_that_it_does_not(settings, said):
    with running(*settings) as beside:
        events = beside.node.create_publisher(Event, 'events', EVENTS)
        events.publish(Event(source='/alone/other', kind=SERVO_FILE,
                             content=servo_at('rv_bench').read_text()))
        beside.wait(lambda: beside.said.get('models') == said)
