"""The service that gives a running twin another servo, beside the thread that steps."""

from __future__ import annotations

from threading import Event, Lock, Thread

import rclpy
from rclpy.executors import ExternalShutdownException, ShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from servo_twin_msgs.srv import LoadServo

from ..description import servo_file, shipped
from ..lockstep.lockstep import warm_up
from ..physics.servo import Servo, ServoError
from .spinning import named

WITHIN = 10.0  # s, from a servo being compiled to its running
HEARS = 0.2  # s, within which the thread hears that it is to end


class ServoLoading:
    """
    Service `twin/load_servo` of a twin node, on a thread and a small node of its own.

    The file is read and compiled here, while the twin goes on stepping; only the exchange is done
    by the twin's own executor, between two samples. Parameter `servo_file` stays as it is: what is
    configured is what the parameters say, and the answer says so.
    """

    def __init__(self, twin: Node) -> None:
        self._twin = twin
        name, where = f'{twin.get_name()}_loader', twin.get_namespace()
        self._node = rclpy.create_node(name, namespace=where, cli_args=named(name, where))
        self._node.create_service(LoadServo, 'twin/load_servo', self.answer)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._closing = Event()
        self._thread = Thread(target=self._spin, daemon=True)
        self._thread.start()

    def answer(self, request: LoadServo.Request, response: LoadServo.Response
               ) -> LoadServo.Response:
        """Load what is wanted; what is refused says why and changes nothing."""
        try:
            servo = wanted(request.path, request.content)
            warm_up(servo)
            said, before = self._exchange(servo)
            response.message = (f'{said}. After a cleanup, configure reads servo_file = '
                                f'{self._twin.get_parameter("servo_file").value!r} as before')
            response.previous = servo_file.dumps(before)
            response.success = True
        except ServoError as problem:
            response.message = str(problem)
        except Exception as problem:  # of the compiler: the service must outlive it
            response.message = f'it does not compile: {type(problem).__name__}: {problem}'
        return response

    def close(self) -> None:
        """
        End thread and node; a daemon that is left behind aborts the process at its end.

        A node that is left behind keeps the participant of Fast DDS until the process exits, and
        there its end and the discovery of another's wait for each other.
        """
        self._closing.set()
        self._thread.join()
        self._executor.shutdown(0.0)
        self._node.destroy_node()

    def _exchange(self, servo: Servo) -> tuple[str, Servo]:
        begins, done, outcome = Lock(), Event(), []

        def on_twins_thread() -> None:
            if not begins.acquire(blocking=False):
                return  # refused meanwhile: what was told as not done must not be done later
            try:
                outcome.append(self._twin.exchange(servo))
            except Exception as problem:  # told by the caller's thread; the twin goes on
                outcome.append(problem)
            finally:
                done.set()

        self._twin.executor.create_task(on_twins_thread)
        if not done.wait(WITHIN):
            if begins.acquire(blocking=False):
                raise ServoError(f'{servo.name}: the twin did not come to it within {WITHIN:g} s; '
                                 'it goes on with the servo that it has')
            done.wait()  # it has begun, and a servo is exchanged in milliseconds
        if isinstance(outcome[0], Exception):
            raise outcome[0]
        return outcome[0]

    def _spin(self) -> None:
        # not spin() and shutdown() from without: that destroys what the thread waits for
        try:
            while rclpy.ok() and not self._closing.is_set():
                self._executor.spin_once(HEARS)
        except (KeyboardInterrupt, ExternalShutdownException, ShutdownException):
            pass


def wanted(path: str, content: str) -> Servo:
    """Return the servo of a path or shipped name, or of its content. Raises ServoError."""
    if bool(path) == bool(content):
        raise ServoError('give either the path of a servo file or its content')
    if content:
        return servo_file.loads(content, 'content')
    return servo_file.load(shipped.servo_file(path))
