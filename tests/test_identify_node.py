"""The identify node, with a twin, as processes fed by a recording of the emulated rig: it ..."""

from pathlib import Path
import subprocess
import sys
from threading import Thread
from time import monotonic, sleep

from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
import pytest
import rclpy
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

from servo_identify.cli import main
from servo_twin_msgs.action import Diagnose, Retrain
from servo_twin_msgs.msg import Estimate, Prediction

pytestmark = pytest.mark.ros
CONFIG = Path(__file__).resolve().parent.parent / 'config'
FRICTION = ['effects.coulomb.level', 'effects.viscous.slope']


def emulated(folder, name, duration, *more):
    words = ['experiment', 'slow_reversals', '--headless', '--speeds', '0.5', '--duration',
             str(duration), '-o', str(folder / name), *more]
    assert main(words) == 0
    return folder / name / 'slow_reversals'


class Graph:
    """Twin and identify node in a namespace, and what they say."""

    def __init__(self, *settings):
        rclpy.init()
        self.node = rclpy.create_node('tester', namespace='rig')
        self.said, self.estimates, self.predictions = {}, [], []
        self.history = []
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 100)
        self.node.create_subscription(Estimate, 'twin/estimate', self.estimates.append, 100)
        self.node.create_subscription(Prediction, 'twin/prediction', self._count, 5000)
        self.clients = {'retrain': ActionClient(self.node, Retrain, 'retrain'),
                        'diagnose': ActionClient(self.node, Diagnose, 'diagnose')}
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.thread = Thread(target=self.executor.spin, daemon=True)
        self.thread.start()
        self.feedback = []
        self.processes = [
            self._start('servo_twin.twin_node', '-p', 'autostart:=true'),
            self._start('servo_identify.identify_node', *(
                word for setting in settings for word in ('-p', setting)))]
        self.wait(lambda: self.fact('twin: twin', 'lifecycle') == 'active')
        for client in self.clients.values():
            assert client.wait_for_server(30.0)

    @staticmethod
    def _start(module, *words):
        return subprocess.Popen([sys.executable, '-m', module, '--ros-args', '-r', '__ns:=/rig',
                                 *words])

    def feed(self, bag, rate):
        """Play the samples of a bag into the graph."""
        self.processes.append(subprocess.Popen(
            [sys.executable, '-m', 'servo_twin.cli', 'replay', str(bag), '--graph', '--rate',
             str(rate)], stdout=subprocess.DEVNULL))

    def _hear(self, message):
        for status in message.status:
            name = status.name.removeprefix('/rig/')
            self.said[name] = (status.message, {v.key: v.value for v in status.values})
            if name.startswith('identify'):
                self.history.append((name, status.message))

    def _count(self, message):
        self.predictions.append((message.sequence, len(message.current)))

    def fact(self, part, key):
        return self.said.get(part, ('', {}))[1].get(key)

    def says(self, part, words):
        return lambda: words in self.said.get(part, ('', {}))[0]

    def wait(self, condition, seconds=60.0):
        until = monotonic() + seconds
        while not condition():
            assert monotonic() < until, f'not within {seconds:g} s; {self.said}'
            sleep(0.02)

    def send(self, action, goal):
        """Send a goal and return its handle."""
        sent = self.clients[action].send_goal_async(
            goal, feedback_callback=lambda m: self.feedback.append(m.feedback))
        self.wait(sent.done)
        return sent.result()

    def result(self, handle):
        asked = handle.get_result_async()
        self.wait(asked.done, 120.0)
        return asked.result().status, asked.result().result

    def call(self, service):
        client = self.node.create_client(Trigger, service)
        assert client.wait_for_service(10.0)
        asked = client.call_async(Trigger.Request())
        self.wait(asked.done)
        return asked.result()

    def close(self):
        for process in self.processes[2:]:
            process.kill()
        for process in self.processes[1::-1]:
            process.terminate()
        codes = [process.wait(30) for process in self.processes[:2]]
        for process in self.processes[2:]:
            process.wait(30)
        self.executor.shutdown()
        self.thread.join(5.0)
        self.node.destroy_node()
        rclpy.try_shutdown()
        assert codes == [0, 0]


@pytest.fixture
def graph():
    """Yield a function that starts a twin and an identify node; both are ended afterwards."""
    graphs = []

    def start(*settings):
        graphs.append(Graph(*settings))
        return graphs[-1]

    yield start
    for one in graphs:
        one.close()


def test_it_retrains_cancels_and_goes_back_while_the_twin_misses_nothing(graph, tmp_path):
    long = emulated(tmp_path, 'long', 160)
    good = emulated(tmp_path, 'good', 8, '--seed', '5')
    other = emulated(tmp_path, 'other', 8, '--set', 'friction.level=2.5')
    rig = graph('trial:=3.0', 'buffer:=20.0', 'online.period:=0.2')
    rig.feed(long, 1.0)
    rig.wait(lambda: int(rig.fact('identify: models', 'samples kept') or 0) > 1500)
    assert not rig.call('identify/go_back').success

    handle = rig.send('retrain', Retrain.Goal(bags=[str(good)], load=True))
    assert not rig.send('retrain', Retrain.Goal(bags=[str(good)])).accepted
    rig.wait(lambda: rig.feedback)
    handle.cancel_goal_async()
    status, result = rig.result(handle)
    assert status == GoalStatus.STATUS_CANCELED
    assert not result.success and 'cancelled; the twin goes on' in result.message

    status, result = rig.result(rig.send('retrain', Retrain.Goal(learn=['luck'], load=True)))
    assert status == GoalStatus.STATUS_ABORTED and "'luck' is not to be learned" in result.message
    status, result = rig.result(rig.send('retrain', Retrain.Goal(bags=[str(good)], budget=0.2)))
    assert not result.success and 'budget of 0.2 s is used up' in result.message
    status, result = rig.result(rig.send('diagnose', Diagnose.Goal(
        bags=[str(good)], servo_file='/nowhere.yaml')))
    assert status == GoalStatus.STATUS_ABORTED and '/nowhere.yaml' in result.message
    rig.wait(lambda: rig.fact('twin: twin', 'servos loaded') == '0')

    status, result = rig.result(rig.send('retrain', Retrain.Goal(
        bags=[str(good)], learn=FRICTION, load=True)))
    assert status == GoalStatus.STATUS_SUCCEEDED, result.message
    assert result.loss_after < result.loss_before
    assert 'std:' in result.servo_file and 'bags:' in result.servo_file
    assert any(f.progress > 0.0 for f in rig.feedback)
    rig.wait(rig.says('identify: models', 'the new servo file stays'))

    status, result = rig.result(rig.send('retrain', Retrain.Goal(
        bags=[str(other)], learn=FRICTION, load=True)))
    assert status == GoalStatus.STATUS_SUCCEEDED, result.message
    rig.wait(rig.says('identify: models', 'went back to the servo file before'))
    assert rig.fact('identify: models', 'returns') == '1'
    rig.wait(lambda: rig.fact('twin: twin', 'servos loaded') == '3')
    assert rig.call('identify/go_back').success

    answered = list(rig.predictions)
    assert all(first + size == then for (first, size), (then, _) in zip(
        answered, answered[1:], strict=False))
    estimate = rig.estimates[-1]
    assert estimate.name[0] == 'effects.coulomb.level'
    assert 15.0 < estimate.value[0] < 30.0 and 0.0 < estimate.std[0] < 10.0


def test_it_names_the_balance_within_seconds_of_an_effect_being_switched_on(graph, tmp_path):
    file = tmp_path / 'rig.yaml'
    file.write_text((CONFIG / 'rigs' / 'rv_bench.yaml').read_text().replace(
        'switches: []', 'switches:\n  - {at: 30.0, set: {friction.load_level: 1.6}}'))
    bag = emulated(tmp_path, 'bag', 40, '--rig', str(file))
    rig = graph('watch.learn:=20.0')
    rig.feed(bag, 2.0)
    rig.wait(rig.says('identify: changes', 'changed: '))
    assert rig.said['identify: changes'][0].startswith('changed: load')
    seen = int(rig.fact('identify: changes', 'load').rpartition(' ')[2])
    assert 30_000 < seen <= 35_000
    assert ('identify: changes', 'no balance changed') in rig.history
    rig.wait(lambda: rig.call('identify/relearn').success)
    rig.wait(rig.says('identify: changes', 'learning what is usual'))
