"""Twin and identify node as processes, fed by a bag or by the emulated rig on its bus."""

import os
from pathlib import Path
import signal
import subprocess
import sys
from threading import Thread
from time import monotonic, sleep

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import rclpy
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile
from std_srvs.srv import Trigger
from way_back import knows_the_way_back

from servo_identify.cli import main
from servo_twin_msgs.action import Diagnose, Retrain
from servo_twin_msgs.msg import Encoder, Estimate, Prediction, Residual

CONFIG = Path(__file__).resolve().parents[2] / 'config'


def emulated(folder, name, duration, *more):
    """Return a bag of the emulated rig, made without its bus."""
    words = ['experiment', 'slow_reversals', '--headless', '--speeds', '0.5', '--duration',
             str(duration), '-o', str(folder / name), *more]
    assert main(words) == 0
    return folder / name / 'slow_reversals'


class Graph:
    """Twin and identify node in a namespace, and what they say; ``close`` ends all of it."""

    def __init__(self, *settings, servo='rv_bench'):
        rclpy.init()
        self.node = rclpy.create_node('tester', namespace='rig')
        self.said, self.estimates, self.predictions, self.residuals = {}, [], [], []
        self.samples, self.excitation, self.players = [], [], []
        self.history, self.feedback, self.fed = [], [], []
        deep = QoSProfile(depth=5000)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, deep)
        self.node.create_subscription(Estimate, 'twin/estimate', self.estimates.append, deep)
        self.node.create_subscription(Encoder, 'encoder', self._sampled, deep)
        self.node.create_subscription(Prediction, 'twin/prediction', self._count, deep)
        self.node.create_subscription(Residual, 'twin/residual', self._keep, deep)
        self.clients = {'retrain': ActionClient(self.node, Retrain, 'retrain'),
                        'diagnose': ActionClient(self.node, Diagnose, 'diagnose')}
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.thread = Thread(target=self.executor.spin, daemon=True)
        self.thread.start()
        servo_file = str(CONFIG / 'servos' / f'{servo}.yaml')
        self.nodes = [
            self._start('servo_twin.nodes.twin_node', 'autostart:=true', 'overload:=60.0',
                        f'servo_file:={servo_file}'),
            self._start('servo_identify.nodes.identify_node', f'servo_file:={servo_file}',
                        *settings)]
        try:
            self.wait(lambda: self.fact('twin: twin', 'lifecycle') == 'active')
            for client in self.clients.values():
                assert client.wait_for_server(60.0)
        except BaseException:
            self.close(judged=False)
            raise

    @staticmethod
    def _start(module, *settings, file=()):
        words = [word for setting in settings for word in ('-p', setting)]
        return subprocess.Popen([sys.executable, '-m', module, '--ros-args', *file, '-r',
                                 '__ns:=/rig', *words])

    def feed(self, bag, rate):
        """Play the samples of a bag into the graph."""
        self.fed.append(subprocess.Popen(
            [sys.executable, '-m', 'servo_twin.cli', 'replay', str(bag), '--graph', '--rate',
             str(rate)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    def bring_up(self, folder, rig, *excitation):
        """Put a copy of a rig file on a bus, drive it by the player; return rig and copy."""
        bus, file = folder / 'rig.can', folder / 'rig.yaml'
        file.write_text((CONFIG / 'rigs' / f'{rig}.yaml').read_text())
        python = [sys.executable, '-m']
        self.fed.append(subprocess.Popen([*python, 'servo_rig_driver.can_bus.can_hub', str(bus)]))
        self.wait(bus.exists)
        emulator = subprocess.Popen([*python, 'servo_rig_driver.emulated.rig_process', '--rig',
                                     str(file),
                                     '--interface', 'unix_bus', '--channel', str(bus)])
        self.fed.append(emulator)
        self.fed.append(self._start(
            'servo_rig_driver.driver.driver_node', 'sync_period:=0.001', 'block_size:=20',
            'autostart:=true', 'enable_after_loss:=true',
            'bus.interface:=unix_bus', f'bus.channel:={bus}',
            file=('--params-file', str(CONFIG / 'driver.yaml'))))
        self.excitation = [*python, 'servo_rig_driver.record.player_node', *excitation, '--wait',
                           '120', '--ros-args', '-r', '__ns:=/rig']
        self._keep_moving()
        return emulator, file

    def _keep_moving(self):
        """Play the excitation of a rig on a bus, again where a busy machine ended it."""
        if self.excitation and (not self.players or self.players[-1].poll() is not None):
            self.players.append(subprocess.Popen(self.excitation))
            self.fed.append(self.players[-1])

    def _hear(self, message):
        for status in message.status:
            name = status.name.removeprefix('/rig/')
            self.said[name] = (status.message, {v.key: v.value for v in status.values})
            if name.startswith('identify'):
                self.history.append((name, status.message))

    def _count(self, message):
        self.predictions.append((message.sequence, len(message.current)))

    def _sampled(self, message):
        self.samples.append((message.sequence, len(message.motor_position)))

    def _keep(self, message):
        self.residuals.append((message.sequence, np.array(message.load)))

    def load_residual(self, first, end):
        """Return the size of the load's balance over samples, in noise floors."""
        rows = np.concatenate([values for at, values in list(self.residuals)
                               if first <= at and at + len(values) <= end])
        return float(np.sqrt(np.nanmean(rows ** 2)))

    @property
    def at(self):
        """Running number of the sample after the last one that was predicted."""
        return sum(self.predictions[-1]) if self.predictions else 0

    def missed(self):
        """
        Return how many samples the twin did not answer since its first answer.

        Those that a driver on a busy machine left out are nobody's to answer.
        """
        answered = {first + k for first, size in list(self.predictions) for k in range(size)}
        begun, end = min(answered), max(answered)
        return sum(begun <= first + k <= end and first + k not in answered
                   for first, size in list(self.samples) for k in range(size))

    def fact(self, part, key):
        return self.said.get(part, ('', {}))[1].get(key)

    def says(self, part, words):
        return lambda: words in self.said.get(part, ('', {}))[0]

    def wait(self, condition, seconds=240.0):
        until = monotonic() + seconds
        while not condition():
            self._keep_moving()
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
        self.wait(asked.done, 400.0)
        return asked.result().status, asked.result().result

    def set_parameter(self, node, name, value):
        """Set a parameter of a node while it runs."""
        client = AsyncParameterClient(self.node, node)
        self.wait(client.services_are_ready)
        knows_the_way_back(self.node, node, self.wait)
        asked = client.set_parameters([Parameter(name, value=value)])
        self.wait(asked.done)
        assert asked.result().results[0].successful, asked.result().results[0].reason

    def call(self, service):
        client = self.node.create_client(Trigger, service)
        self.wait(client.service_is_ready)
        knows_the_way_back(self.node, 'identify', self.wait)
        asked = client.call_async(Trigger.Request())
        self.wait(asked.done)
        return asked.result()

    def close(self, judged=True):
        for process in reversed(self.fed):
            if process.poll() is None:
                process.terminate()
        for process in reversed(self.nodes):
            process.terminate()
        codes = [process.wait(60) for process in self.nodes]
        for process in self.fed:
            try:
                process.wait(60.0)
            except subprocess.TimeoutExpired:
                os.kill(process.pid, signal.SIGKILL)
                process.wait()
        self.executor.shutdown()
        self.thread.join(5.0)
        self.node.destroy_node()
        rclpy.try_shutdown()
        assert not judged or codes == [0, 0]
