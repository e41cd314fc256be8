"""The servo file that the twin runs, as given from here: one at a time, and back again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Lock
import time

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from std_srvs.srv import Trigger

from servo_twin_msgs.srv import LoadServo

from ..jobs.live.sample_ring import Ring
from ..jobs.live.servo_versions import Models
from .short_memory import Shortage

SERVICES = {'twin/load_servo': LoadServo, 'identify/go_back': Trigger,
            'identify/load_augmented': Trigger}
LOOK_EVERY = 0.1  # s between two looks at an answer
_LOADING = 60.0  # s that the twin may take to compile and load


class TwinServo:
    """
    Gives the twin servo files, by `twin/load_servo`.

    Serves `identify/go_back` and `identify/load_augmented`; ``augmented`` is the file of the last
    diagnosis. ``closing`` is set when the node ends: then no answer is waited for.
    """

    def __init__(self, node: Node, group: CallbackGroup, models: Models, ring: Ring,
                 closing: Event, shortage: Shortage) -> None:
        self.augmented: Path | None = None
        self._models, self._ring, self._closing = models, ring, closing
        self._loads = Lock()
        self._client = node.create_client(LoadServo, 'twin/load_servo', callback_group=group)
        for name, answer in (('identify/go_back', self._go_back),
                             ('identify/load_augmented', self._load_augmented)):
            node.create_service(Trigger, name, shortage.guarded(answer), callback_group=group)

    def load(self, text: str) -> str:
        """Have the twin run a servo file; raises ValueError with what it says against it."""
        with self._giving():
            answer = self._ask(text)
            self._models.loaded(text, answer.previous, self._ring.next)
        return answer.message

    def return_to_previous(self, why: str) -> str:
        """Have the twin run the file before; raises ValueError when it does not."""
        with self._giving():
            if not self._models.previous:
                raise ValueError('there is no servo file to go back to: none was loaded from here')
            back = self._models.previous
            answer = self._ask(back)
            self._models.returned(back, answer.previous, why)
        return answer.message

    @contextmanager
    def _giving(self) -> Iterator[None]:
        """
        Give the twin one file at a time; raises ValueError while another one is on its way.

        Who waited would take the threads away by which the twin's answer comes.
        """
        if not self._loads.acquire(blocking=False):
            raise ValueError('refused: the twin is just being given a servo file; wait for that')
        try:
            yield
        finally:
            self._loads.release()

    def _ask(self, text: str) -> LoadServo.Response:
        if not self._client.wait_for_service(5.0):
            raise ValueError('no twin runs here: its service twin/load_servo is not there')
        answered = Event()
        self._models.asks(text)
        future = self._client.call_async(LoadServo.Request(content=text))
        future.add_done_callback(lambda _: answered.set())
        until = time.monotonic() + _LOADING
        while not (answered.wait(LOOK_EVERY) or self._closing.is_set()
                   or time.monotonic() > until):
            pass
        if answered.is_set() and future.result().success:
            return future.result()
        self._models.asks('')
        if not answered.is_set():
            raise ValueError('this node ends, and the twin has not answered yet'
                             if self._closing.is_set() else
                             f'the twin did not answer within {_LOADING:g} s')
        raise ValueError(f'the twin refused the servo file: {future.result().message}')

    def _go_back(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            response.message = self.return_to_previous('it was asked for')
            response.success = True
        except ValueError as problem:
            response.message = str(problem)
        return response

    def _load_augmented(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            if self.augmented is None:
                raise ValueError('there is no augmented servo file: nothing was diagnosed yet')
            response.message = self.load(self.augmented.read_text())
            response.success = True
        except (ValueError, OSError) as problem:
            response.message = str(problem)
        return response
