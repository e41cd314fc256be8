"""What the soak tells the nodes: set-points that tell their own time, and things nobody means."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nan
from random import Random
from threading import Event, Thread
from time import time

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from witness import Ears, reference

from servo_twin_msgs.msg import Command
from servo_twin_msgs.srv import LoadServo

EACH, AHEAD = 0.05, 0.15  # s: a block each so long, of so much


class Graph:
    """
    Plays the reference and calls services; nothing waits for an answer for long.

    ``ahead`` tells how far, s, the clock of the rig's machine was set.
    """

    def __init__(self, ears: Ears, ahead: Callable[[], float]) -> None:
        self.ears, self._ahead = ears, ahead
        self.refused = self.taken = 0
        self._stop = Event()
        self._player = Thread(target=self._play, daemon=True)
        self.loads = ears.node.create_client(LoadServo, 'twin/load_servo')
        self.sets = {name: ears.node.create_client(SetParameters, f'{name}/set_parameters')
                     for name in ('twin', 'driver')}
        self.changes = ears.node.create_client(ChangeState, 'driver/change_state')

    def play(self) -> None:
        """Begin to send set-points."""
        self._player.start()

    def _play(self) -> None:
        while not self._stop.wait(EACH):
            begin = time()
            message = Command(mode=Command.VELOCITY, period=0.002, reference=[
                reference(begin + 0.002 * k) for k in range(int(AHEAD / 0.002))])
            stamp = begin + self._ahead()  # who sends reads the clock of the rig's machine
            message.header.stamp.sec = int(stamp)
            message.header.stamp.nanosec = int(stamp % 1.0 * 1e9)
            self.ears.command.publish(message)

    def close(self) -> None:
        """Send no more."""
        self._stop.set()
        self._player.join(2.0)

    def call(self, client, request, patience: float = 3.0):
        """Return the answer to a call, None where there is none in time."""
        if not client.service_is_ready():
            return None
        answered, future = Event(), client.call_async(request)
        future.add_done_callback(lambda _: answered.set())
        return future.result() if answered.wait(patience) else None

    def activate(self) -> bool:
        """Take the driver down and up again, as somebody at the bench does."""
        for transition in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVATE):
            answer = self.call(self.changes, ChangeState.Request(
                transition=Transition(id=transition)), 10.0)
        return bool(answer and answer.success)

    def deactivate(self) -> bool:
        """Take the driver down."""
        answer = self.call(self.changes, ChangeState.Request(
            transition=Transition(id=Transition.TRANSITION_DEACTIVATE)), 10.0)
        return bool(answer and answer.success)

    def odd_parameters(self, random: Random) -> None:
        """Set parameters to what they may and may not be."""
        for _ in range(8):
            name = random.choice(('drive.gain', 'mechanism.stiffness', 'mechanism.ratio',
                                  'effects.none.level', 'bridge', 'mode', 'command_timeout'))
            value = random.choice((0.49, 5e5, 161.0, nan, inf, -1.0, 1e300, 0.0))
            kind = random.choice((ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_STRING))
            told = ParameterValue(type=kind, double_value=value, string_value='x')
            if name in ('mechanism.ratio', 'command_timeout') and value == value and value > 0.0:
                told.double_value = nan  # another ratio or timeout is another promise
            answer = self.call(self.sets[random.choice(('twin', 'driver'))],
                               SetParameters.Request(
                                   parameters=[Parameter(name=name, value=told)]))
            done = answer is not None and answer.results[0].successful
            self.taken, self.refused = self.taken + done, self.refused + (not done)

    def odd_commands(self, random: Random) -> None:
        """Send set-points that must be refused."""
        for _ in range(20):
            message = Command(mode=random.choice((3, 99, 255)), period=random.choice((
                0.002, 0.0, -1.0, nan, inf)), reference=random.choice((
                    [nan] * 5, [inf], [], [-inf, 0.1])),
                external_torque=random.choice(([], [nan])))
            message.header.stamp.sec = random.choice((0, int(time()), 2**31 - 1))
            self.ears.command.publish(message)

    def odd_servo(self, random: Random) -> None:
        """Give the twin servo files that are none, and its own again."""
        for content in ('', '[' * 50, 'servo: x', '!!python/object/apply:os.system ["true"]',
                        'a: &x 1\nb: *x', random.randbytes(200).decode('latin1')):
            self.call(self.loads, LoadServo.Request(content=content))
        self.call(self.loads, LoadServo.Request(path='/dev/null'))
