"""
The twin node: runs a servo in lockstep with the rig of its namespace.

It subscribes to `encoder`, `torque` and `current`, publishes `twin/prediction` and `twin/residual`
with the stamps and sequence numbers of the samples, `twin/plot/residual` for plotting tools, and
its health on /diagnostics. Service `twin/load_servo` exchanges the servo file. Every value of the
servo is a parameter.
"""

from __future__ import annotations

import gc
import sys

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.task import Future

from servo_twin_msgs.msg import Event

from ..description import servo_file
from ..lockstep.lockstep import Lockstep, warm_up
from ..lockstep.twin import changed
from ..physics.servo import Servo, ServoError
from ..recording import events
from . import message_conversion as conversion
from . import servo_parameters, twin_parameters
from .free_output import free_output
from .given_parameters import cannot_start, in_words, refuse_unknown, UNFIT
from .live_answers import judge_names, LiveAnswers
from .managed_node import ManagedNode
from .namesake import Namesake, PROCESS
from .node_help import asked_for_help
from .servo_loading import ServoLoading
from .spinning import interruptible, started
from .timer_clock import STEADY
from .topic_qos import EVENTS
from .twin_health import ERROR, OK

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
REPORT_EVERY = 1.0  # s


class TwinNode(ManagedNode):
    """Parameters, transitions, events and health; LiveAnswers has the samples."""

    def __init__(self, **kwargs: object) -> None:
        super().__init__('twin', **kwargs)
        twin_parameters.declare(self)
        judge_names(self)
        self.settings = twin_parameters.settings(self)
        self._servo: Servo | None = None
        self._answers = LiveAnswers(self, self._begin, self._say_begun)
        self._declaring, self._told, self._failure = False, '', ''
        self.finished: Future = Future()
        self._namesake = Namesake(self, self._give_way)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._events = self.create_publisher(Event, 'events', EVENTS)
        self.add_on_set_parameters_callback(self._judge)
        self.add_post_set_parameters_callback(self._apply)
        self.create_timer(REPORT_EVERY, self._report, clock=STEADY)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read the servo file, declare its values, compile."""
        try:
            self._failure = ''
            servo = servo_file.load(twin_parameters.servo_path(self))
            self._declaring = True
            self._servo = servo
            self._servo = servo_parameters.declare(self, servo, overrides=True)
            refuse_unknown(self)
            warm_up(self._servo)
            self.settings = twin_parameters.settings(self)
            Lockstep(self._servo, self._servo.step, self.settings)
        except (*UNFIT, ServoError) as problem:
            self._failure = f'cannot be configured: {in_words(problem)}'
            self.get_logger().error(in_words(problem))
            self._forget()
            return FAILURE
        finally:
            self._declaring = False
        gc.freeze()  # the compiler's many objects stay: looking through them holds samples up
        self._answers.open()
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Step from the next sample on."""
        self._answers.activate()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Publish the residuals still owed, and let the samples pass by."""
        self._answers.deactivate()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Give the servo and the topics up."""
        self._forget()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Give everything up, whatever the state was."""
        self._forget()
        return super().on_shutdown(state)

    def _forget(self) -> None:
        self._answers.close()
        if self._servo is not None:
            servo_parameters.withdraw(self, self._servo)
            self._servo = None

    def rest(self) -> None:
        """Let the samples pass by, from a signal handler: who ends soon need not catch up."""
        self._answers.active = False

    def _begin(self, period: float) -> Lockstep:
        """Return a new lockstep at a period, s, and say so. Raises ServoError."""
        lockstep = Lockstep(self._servo, period, self.settings)
        self._say_begun(period)
        return lockstep

    def _say_begun(self, period: float) -> None:
        """Tell all that a replay from the next sample on has to know; ``period`` in s."""
        mode = self.settings.mode.replace('_', ' ')
        self._happened(
            events.BEGAN, f'{self._servo.name} runs at {1.0 / period:.6g} Hz, {mode}',
            events.written({**vars(self.settings), events.ZERO: self._answers.zero,
                            'servo_file': servo_file.dumps(self._servo)}))

    def _now(self) -> int:
        return self.get_clock().now().nanoseconds

    def _judge(self, parameters: list[Parameter]) -> SetParametersResult:
        if self._declaring:
            return SetParametersResult(successful=True)
        try:
            twin_parameters.judge(self, parameters, self._servo)
            if self._servo is not None:
                changed(self._servo, servo_parameters.changes_in(parameters, self._servo))
        except ServoError as problem:
            return SetParametersResult(successful=False, reason=str(problem))
        return SetParametersResult(successful=True)

    def _apply(self, parameters: list[Parameter]) -> None:
        if self._declaring:
            return
        before, self.settings = self.settings, twin_parameters.settings(self)
        if self._answers.lockstep is not None and self.settings != before:
            self._answers.lockstep.follow(self.settings)
            now = vars(self.settings)
            self._happened(events.SETTINGS, ', '.join(
                f'{name} = {value}' for name, value in now.items()
                if value != vars(before)[name]), events.written(now))
        if self._servo is None:
            return
        changes = {path: value for path, value in servo_parameters.changes_in(
            parameters, self._servo).items() if value != self._servo.values[path]}
        if changes and self._answers.lockstep is not None:
            self._answers.lockstep.set(changes, servo_parameters.SOURCE)
        if changes:
            told = ', '.join(f'{path} = {value}' for path, value in changes.items())
            self._happened(events.PARAMETERS, told, events.written(changes))
            self._servo = changed(self._servo, changes, servo_parameters.SOURCE)

    def exchange(self, servo: Servo) -> tuple[str, Servo]:
        """
        Run another servo, already compiled, from the next sample on.

        Returns what happened and the servo before. Raises ServoError, changing nothing.
        """
        before = self._servo
        if before is None:
            raise ServoError('the twin is not configured: give it a servo file and configure it')
        running = self._answers.lockstep or Lockstep(servo, servo.step, self.settings)
        kept = running.load(servo) and running is self._answers.lockstep
        self._declaring = True
        try:
            servo_parameters.withdraw(self, before)
            self._servo = servo
            servo_parameters.declare(self, servo, overrides=False)
        finally:
            self._declaring = False
        self._answers.health.loaded += 1
        how = 'its state was kept' if kept else 'it begins again'
        said = f'{servo.name} runs in place of {before.name}; {how}'
        self.get_logger().info(said)
        self._happened(events.SERVO_FILE, said, servo_file.dumps(servo))
        return said, before

    def _happened(self, kind: str, text: str, content: str) -> None:
        """Publish what changed, and from which sample on, so that a replay can do the same."""
        event = Event(source=self.get_fully_qualified_name(), kind=kind, text=text,
                      sequence=self._answers.next, content=content)
        event.header.stamp = conversion.to_time(self._now())
        self._events.publish(event)

    def _give_way(self, why: str) -> None:
        """Answer no further sample, and end."""
        self._answers.active, self._failure = False, why
        self._report()
        self.finished.set_result(why)

    def _report(self) -> None:
        label = self._state_machine.current_state[1]
        level, said, facts = (ERROR, self._failure, {}) if self._failure else (OK, label, {})
        if self._answers.active:
            level, said, facts = self._answers.report()
        facts = {PROCESS: self._namesake.process, 'lifecycle': label,
                 'servo': self._servo.name if self._servo else 'none',
                 'mode': self.settings.mode, **facts, **self._answers.readers}
        self._diagnostics.publish(conversion.to_diagnostics(
            self.get_fully_qualified_name(), level, said, facts, self._now()))
        if level != OK and said != self._told:
            self.get_logger().warning(said)
        self._told = said


def main(arguments: list[str] | None = None) -> int:
    """Run the twin node until told to stop; 1: another has its name, 2: a bad parameter."""
    if asked_for_help('twin_node', __doc__, 'config/twin.yaml'):
        return 0
    free_output()
    sys.setswitchinterval(5e-4)  # a servo that is being compiled must not hold samples up
    ending = started(arguments)
    try:
        node = TwinNode()
    except UNFIT as problem:
        return cannot_start('twin_node', problem)
    executor, loading = EventsExecutor(), ServoLoading(node)
    executor.add_node(node)
    try:
        with interruptible(ending):
            if twin_parameters.autostart(node) and node.trigger_configure() == SUCCESS:
                node.trigger_activate()
        ending.then = node.rest
        ending.spin(executor, node.finished)
    finally:
        refused = node.finished.done()
        loading.close()
        node.destroy_node()
        rclpy.try_shutdown()
    return int(refused)


if __name__ == '__main__':
    raise SystemExit(main())
