"""A twin node as a process of its own, and a rig beside it that says what a test wants."""

from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import nan
from pathlib import Path
import subprocess
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import numpy as np
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
import rclpy
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future
from way_back import knows_the_way_back

from servo_twin.nodes.message_conversion import to_time, TOPICS
from servo_twin.recording.joined_samples import CHANNELS, samples_of
from servo_twin_msgs.msg import Prediction, Residual

PERIOD = 1e-3
BENCH = """
servo: bench
drive: {type: current, gain: 0.49, torque_constant: 0.4878}
mechanism: {type: two_inertia, rotor_inertia: 1.14e-4, load_inertia: 5.76, ratio: 161.0,
            stiffness: 5.0e+5, damping: 40.0}
sensors: {motor_encoder: {}, load_encoder: {}, torque_sensor: {}, current_sensor: {}}
effects:
  bearing: {effect: coulomb_friction, at: load, level: 20.0}
"""
OTHER = BENCH.replace('servo: bench', 'servo: other').replace('bearing', 'seal')


class Rig:
    """A rig of its own namespace that says what the test wants, and a twin process beside it."""

    def __init__(self, node: Node, executor: EventsExecutor, name: str, file: str,
                 *more: str) -> None:
        self.node, self.executor, self.name = node, executor, name
        self.predictions: list[Prediction] = []
        self.residuals: list[Residual] = []
        self.told: list = []
        self.topics = {topic: node.create_publisher(kind, f'{name}/{topic}', 5000)
                       for topic, kind in TOPICS.items()}
        node.create_subscription(Prediction, f'{name}/twin/prediction', self.predictions.append,
                                 5000)
        node.create_subscription(Residual, f'{name}/twin/residual', self.residuals.append, 5000)
        node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 10)
        self.begin(file, *more)

    def begin(self, file: str, *more: str) -> None:
        """Start the twin."""
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'servo_twin.nodes.twin_node', '--ros-args', '-r',
             f'__ns:=/{self.name}',
             '-p', 'autostart:=true', '-p', f'servo_file:={file}', '-p', 'catch:=0.0',
             *(word for setting in more for word in ('-p', setting))])

    def _hear(self, message: DiagnosticArray) -> None:
        self.told += [s for s in message.status if s.name == f'/{self.name}/twin: twin']

    def wait(self, condition: Callable[[], bool], seconds: float = 60.0) -> None:
        """Run callbacks until a condition holds; fails after some seconds."""
        done, limit = Future(), time.monotonic() + seconds

        def look() -> None:
            if not done.done() and (condition() or time.monotonic() > limit):
                done.set_result(None)

        timer = self.node.create_timer(0.01, look)
        self.executor.spin_until_future_complete(done, seconds + 5.0)
        self.node.destroy_timer(timer)
        assert condition(), f'not within {seconds:g} s'

    def ready(self) -> 'Rig':
        """Ask with empty blocks until the twin hears all topics and is heard on its own."""
        self.predictions.clear()
        self.residuals.clear()
        self.told.clear()

        def asked() -> bool:
            self.say(0, samples(0))
            return bool(self.predictions and self.residuals and self.told)

        self.wait(asked)
        self.say(1, samples(0))
        self.wait(lambda: self.predictions[-1].sequence == self.residuals[-1].sequence == 1)
        self.predictions.clear()
        self.residuals.clear()
        return self

    def ask(self, kind, service: str, request):
        """Call a service of the twin."""
        client = self.node.create_client(kind, f'/{self.name}/{service}')
        self.wait(client.service_is_ready)
        knows_the_way_back(self.node, f'/{self.name}/twin', self.wait)
        future = client.call_async(request)
        self.wait(future.done)
        self.node.destroy_client(client)
        return future.result()

    def goes(self, transition: int) -> None:
        """Have the twin make a transition of its lifecycle."""
        assert self.makes(transition)

    def makes(self, transition: int) -> bool:
        """Ask the twin for a transition of its lifecycle; return whether it was made."""
        return self.ask(ChangeState, 'twin/change_state', ChangeState.Request(
            transition=Transition(id=transition))).success

    def set(self, name: str, value: float | str):
        """Set a parameter of the twin."""
        kind = {'type': ParameterType.PARAMETER_STRING, 'string_value': value} if isinstance(
            value, str) else {'type': ParameterType.PARAMETER_DOUBLE, 'double_value': value}
        parameter = Parameter(name=name, value=ParameterValue(**kind))
        return self.ask(SetParameters, 'twin/set_parameters',
                        SetParameters.Request(parameters=[parameter])).results[0]

    def say(self, sequence: int, samples: np.ndarray, lack: str = '', frame: str = '',
            period: float = PERIOD, second: int = 10**9) -> None:
        """Publish a block of samples, on all topics but one; sample 0 was taken at ``second``."""
        columns = {name: array('d', column.tobytes())
                   for name, column in zip(CHANNELS, samples.T, strict=True)}
        for topic, kind in TOPICS.items():
            message = kind(sequence=sequence, period=period, **{
                field: columns[field] for field in kind.get_fields_and_field_types()
                if field in columns})
            message.header.stamp = to_time(second * 10**9 + round(sequence * PERIOD * 1e9)
                                           if sequence < 1 << 31 else second * 10**9)
            message.header.frame_id = frame
            if topic != lack:
                self.topics[topic].publish(message)


@pytest.fixture(scope='module')
def servo_files(tmp_path_factory):
    """The bench and another servo, as files."""
    folder = tmp_path_factory.mktemp('servos')
    for name, text in (('bench', BENCH), ('other', OTHER)):
        (folder / f'{name}.yaml').write_text(text)
    return folder


@contextmanager
def twins(folder: Path, context: Context | None = None) -> Iterator[Callable[..., Rig]]:
    """Give a function that starts a twin in a namespace; all are ended afterwards."""
    rclpy.init(context=context)
    node, rigs = rclpy.create_node('feeder', context=context), []
    executor = EventsExecutor(context=context)
    executor.add_node(node)

    def start(name: str, *settings: str) -> Rig:
        rigs.append(Rig(node, executor, name, f'{folder}/bench.yaml', *settings))
        return rigs[-1]

    yield start
    for rig in rigs:
        rig.process.terminate()
    codes = [rig.process.wait(60.0) for rig in rigs]
    node.destroy_node()
    rclpy.try_shutdown(context=context)
    assert codes == [0] * len(rigs)


@pytest.fixture
def graph(servo_files):
    """Yield a function that starts a twin in a namespace, for one test."""
    with twins(servo_files) as start:
        yield start


@pytest.fixture(scope='module')
def shared_twin(servo_files):
    """A twin as its servo file has it, for many tests; each takes it as ``rig``."""
    with twins(servo_files, Context()) as start:
        yield start('shared').ready()


@pytest.fixture
def rig(shared_twin):
    """The shared twin, begun anew."""
    shared_twin.goes(Transition.TRANSITION_DEACTIVATE)
    shared_twin.goes(Transition.TRANSITION_ACTIVATE)
    return shared_twin.ready()


def samples(size: int, voltage: float = 1.0) -> np.ndarray:
    """Return samples of a rig that stands still although it gets a command."""
    columns = {name: np.full(size, nan) for name in CHANNELS}
    columns |= {name: np.zeros(size) for name in ('motor_position', 'load_position', 'torque',
                                                  'current')}
    return samples_of(columns | {'voltage': np.full(size, voltage)})


def ends_of(messages) -> list[int]:
    """Return the number of the sample after the last one of each message."""
    return [m.sequence + len(m.load_position) for m in messages]
