"""A driver in a process of its own, and a node that hears all that it says."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import takewhile
import os
from pathlib import Path
import signal
import subprocess
import sys
from threading import Thread
from time import monotonic, sleep
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from held_up import watch
import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from servo_twin_msgs.msg import Command, Current, Encoder, Torque

CONFIG = Path(__file__).resolve().parents[2] / 'config' / 'driver.yaml'
PATIENCE = 60.0  # s, of a busy machine; nothing waits for longer than it has to


def wait_for(condition: Callable[[], Any], what: str, patience: float = PATIENCE) -> Any:
    """Return the first true value of a condition; raises AssertionError when there is none."""
    deadline = monotonic() + patience
    while monotonic() < deadline:
        value = condition()
        if value:
            return value
        sleep(0.01)
    raise AssertionError(f'{what}: not within {patience:g} s')


class DriverProcess:
    """
    The driver with the shipped parameters, and others on top of them, in a namespace.

    ``file`` is the driver file of a shipped drive, on top of driver.yaml; ``start`` is what Python
    is to run.
    """

    def __init__(self, namespace: str, file: Path | None = None,
                 start: tuple[str, str] = ('-m', 'servo_rig_driver.driver.driver_node'),
                 **values: Any) -> None:
        # alone as it is in its namespace it need not look for others
        values = {'autostart': 'true', 'graph_listen_time': 0.0, 'enable_after_loss': 'true',
                  **values}
        told = [f'{key.replace("__", ".")}:={value}' for key, value in values.items()]
        self.process = subprocess.Popen(
            [sys.executable, *start, '--ros-args', '--params-file', str(CONFIG),
             *(['--params-file', str(file)] if file else []),
             '-r', f'__ns:=/{namespace}',
             *[word for parameter in told for word in ('-p', parameter)]],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=dict(os.environ))
        watch(self.process.pid)

    def wait(self, patience: float = PATIENCE) -> tuple[int, str]:
        """Return exit status and output of a driver that ends by itself."""
        said = self._said(patience)
        return self.process.returncode, said

    def close(self) -> str:
        """Stop it as a service manager would; returns what it said."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        return self._said(PATIENCE)

    def _said(self, patience: float) -> str:
        try:
            return self.process.communicate(timeout=patience)[0]
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise


class Listener:
    """
    Keeps every sample, joint state and diagnosis of one rig.

    With ``commands`` False it publishes none, as a driver takes those of one publisher alone.
    """

    def __init__(self, namespace: str, commands: bool = True) -> None:
        self.encoder: list[Encoder] = []
        self.torque: list[Torque] = []
        self.current: list[Current] = []
        self.joint_states: list[JointState] = []
        self.diagnoses: list[DiagnosticArray] = []
        self._kinds = self.encoder, self.torque, self.current
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = Node('listener', namespace=namespace, context=self.context)
        deep = QoSProfile(depth=20000)
        for kind, name, kept in ((Encoder, 'encoder', self.encoder),
                                 (Torque, 'torque', self.torque),
                                 (Current, 'current', self.current),
                                 (JointState, 'joint_states', self.joint_states)):
            self.node.create_subscription(kind, name, kept.append, deep)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnosis, deep)
        self._command = self.node.create_publisher(Command, 'command', deep) if commands else None
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._thread = Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def _diagnosis(self, message: DiagnosticArray) -> None:
        if message.status[0].hardware_id == f'{self.node.get_namespace()}/driver':
            self.diagnoses.append(message)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._thread.join(5.0)
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)

    def command(self, mode: int, reference: list[float], start: int, period: float = 1e-3,
                external: list[float] | None = None) -> None:
        """Send a block of set-points from ``start`` ns on."""
        message = Command(mode=mode, period=period, reference=reference,
                          external_torque=external or [])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(start, 10**9)
        self._command.publish(message)

    def now(self) -> int:
        """Return the time of the latest message of samples, ns."""
        return max(instant(kept[-1]) for kept in self._kinds if kept)

    def more_samples(self, number: int = 100) -> int:
        """Wait for so many more messages of each kind; returns the time of the latest before."""
        since = self.now() if any(self._kinds) else -1
        wait_for(lambda: all(len(later(kept, since)) >= number for kept in self._kinds),
                 f'{number} more messages')
        return since

    def column(self, kept: list, name: str, since: int) -> tuple[np.ndarray, np.ndarray]:
        """Return (sequence numbers, values) of a column, of messages later than ``since`` ns."""
        kept = later(kept, since)
        numbers = [message.sequence + np.arange(len(getattr(message, name))) for message in kept]
        return (np.concatenate(numbers),
                np.concatenate([np.array(getattr(message, name)) for message in kept]))

    @contextmanager
    def every_sample(self) -> Iterator[int]:
        """
        Give the time of the latest message; check that no later sample is missing.

        A machine too busy to serve a rig in time makes the driver leave samples out, but never
        without a word: only as many may be missing as it has counted since.
        """
        self.more_samples(1)  # now each kind of message is heard
        since, known = self.now(), self._left_out()
        yield since
        self.more_samples(1)
        for kept, name in ((self.encoder, 'load_position'), (self.torque, 'torque'),
                           (self.current, 'current')):
            numbers, _ = self.column(kept, name, since)
            assert (np.diff(numbers) > 0).all()
            missing = numbers[-1] - numbers[0] + 1 - len(numbers)
            if missing:
                wait_for(lambda lost=missing: self._left_out() - known >= lost,
                         f'the driver has counted the {missing} samples missing from {name}')

    def _left_out(self) -> int:
        counted = {pair.key: int(pair.value) for pair in self.status('samples').values}
        return counted.get('not_asked', 0) + counted.get('unanswered', 0)

    def status(self, part: str) -> DiagnosticStatus | None:
        """Return the latest status of a part of the rig's health."""
        if not self.diagnoses:
            return None
        return next(status for status in self.diagnoses[-1].status
                    if status.name.endswith(f': {part}'))

    def hears(self, part: str, words: str, level: int | None = None) -> DiagnosticStatus:
        """Wait until the status of a part says these words; what passes may have begun before."""
        first = max(0, len(self.diagnoses) - 3)

        def heard() -> DiagnosticStatus | None:
            for diagnosis in self.diagnoses[-1:] if level == 0 else self.diagnoses[first:]:
                for status in diagnosis.status:
                    if status.name.endswith(f': {part}') and words in status.message and (
                            level is None or status.level == bytes([level])):
                        return status
            return None
        try:
            return wait_for(heard, f'{part} says "{words}"')
        except AssertionError as error:
            told = [(status.name, status.message, [(v.key, v.value) for v in status.values])
                    for status in self.diagnoses[-1].status]
            raise AssertionError(f'{error}; after {len(self.diagnoses)} it says {told}') from None

    def has_heard(self, words: str) -> str:
        """Wait until the status of the rig says these words, of now or of what has passed."""
        def told() -> str:
            rig = self.status('rig')
            said = [] if rig is None else [rig.message, *(
                v.value for v in rig.values if v.key.startswith('past'))]
            return next((one for one in said if words in one), '')
        return wait_for(told, f'the rig says "{words}"')

    def all_well(self) -> None:
        """Wait until the drive is enabled and nothing is wrong but passing events."""
        wait_for(lambda: self.diagnoses and value(self.status('rig'), 'drive')
                 == 'operation enabled' and self.status('rig').level != b'\x02',
                 'the drive is enabled and nothing is wrong')


def alive(pid: int) -> bool:
    """Whether a process runs: one that has ended and that nobody waits for does not (Linux)."""
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
    except OSError:
        return False


def instant(message: Any) -> int:
    """Return the stamp of a message as ns."""
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def later(kept: list, since: int) -> list:
    """Return the messages stamped later than ``since`` ns, of those kept in their order."""
    return list(takewhile(lambda message: instant(message) > since, reversed(kept)))[::-1]


def value(status: DiagnosticStatus | None, key: str) -> str | None:
    """Return a value of a status by its key."""
    return next((pair.value for pair in status.values if pair.key == key), None)
