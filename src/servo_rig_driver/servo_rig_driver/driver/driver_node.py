"""
The driver: a lifecycle node between a rig's CAN bus and its topics.

    python -m servo_rig_driver.driver.driver_node --ros-args --params-file config/driver.yaml

configure   opens the bus, reads the tables of the device, listens for another driver
activate    brings the drive to OPERATION ENABLED and publishes every sample
deactivate  quick stop, then no torque, then no SYNC; cleanup and shutdown do the same
cleanup     leaves the bus

A signal, or the end of the process that started it, takes the drive down in the same order.
"""

from __future__ import annotations

from math import ceil
import sys

import can
import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.task import Future
from sensor_msgs.msg import JointState

from servo_twin_msgs.msg import Command, Current, Encoder, Event, Torque

from ..can_bus.bus_opening import BusError, BusSettings, open_bus, Wire
from ..devices.device import DeviceError
from ..devices.drive_master import DriveMaster
from ..devices.object_dictionary import DictionaryError
from ..devices.pdo_table import FrameError
from ..devices.protocols import PROTOCOLS
from ..ending import Ending
from ..free_output import free_output
from ..given_parameters import cannot_start, judge_remaps, refuse_unknown, UNFIT
from ..managed_node import ManagedNode
from ..namesake import Namesake, PROCESS
from ..node_help import asked_for_help
from ..ros_start import start_ros
from ..timer_clock import STEADY
from . import driver_parameters as parameters
from . import message_conversion as conversion
from .command_intake import CommandIntake
from .command_sources import CommandSources
from .encoder_leaps import EncoderLeaps
from .health_report import Diagnoser
from .limits import Limits, Mode
from .link_states import NOT_DOWN
from .paced_requests import LinkSettings
from .rig_health import RigHealth
from .rig_link import ForeignDriver, RigLink
from .sample_blocks import SampleBlock
from .sampler import Sampler
from .setpoints import SetpointPlayer

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
LOOK_EVERY = 0.1
SAMPLES = {'encoder': Encoder, 'torque': Torque, 'current': Current}
OVERRIDABLE = QoSOverridingOptions.with_default_policies()


def sample_qos(period: float, block_size: int, history: float) -> QoSProfile:
    """Return the QoS of a sample topic: reliable, ``history`` s deep, at least 1000 messages."""
    return QoSProfile(depth=max(1000, ceil(history / (period * block_size))),
                      history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.RELIABLE)


class Driver(ManagedNode):
    """Parameters, topics and transitions; the work is done by RigLink and what it holds."""

    def __init__(self, **kwargs: object) -> None:
        super().__init__('driver', **kwargs)
        parameters.declare(self)
        refuse_unknown(self)
        judge_remaps(self, {**SAMPLES, 'joint_states': JointState, 'command': Command,
                            'events': Event})
        parameters.refuse_simulated_time(self)
        self.add_on_set_parameters_callback(self._judge_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        self.health = RigHealth()
        self.finished: Future = Future()
        self._values = parameters.values(self)
        self._link: RigLink | None = None
        self._player: SetpointPlayer | None = None
        self._carried: dict[Mode, tuple[float, float]] = {}
        self._topics: list = []
        self._subscription = None
        self._modes: list[Mode] = []
        self._intake: CommandIntake | None = None
        self._messages: conversion.SampleMessages | None = None
        self._joint_states: conversion.JointStates | None = None
        self._leaps = EncoderLeaps(self.health)
        self._tried_at = 0
        self._led = False  # by hand, or by a start that was made: autostart does no more
        self.health.trouble('bus.closed', 'the bus is not open: the driver is not configured',
                            self._ros_now())
        self._namesake = Namesake(self, self._give_way)
        self.diagnoser = Diagnoser(self, self.health, self._facts)
        self.create_timer(LOOK_EVERY, self._look, clock=STEADY)

    # Transitions.

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the bus and the topics."""
        self._values = of = parameters.values(self)
        try:
            self._link = self._make_link(of)
            self._link.open()
        except (can.CanError, BusError, DeviceError, DictionaryError, FrameError,
                ForeignDriver, parameters.Contradiction) as error:
            self.health.trouble('bus.configure', str(error), self._ros_now())
            self._link = None
            if isinstance(error, ForeignDriver) and of['autostart']:
                self.finished.set_result(str(error))
            return FAILURE
        self.health.over('bus.configure', self._ros_now())
        self.health.over('bus.closed', self._ros_now())
        self._led = True
        frame = of['frame_id'] or f'{self.get_namespace()}/base_link'.strip('/')
        self._messages = conversion.SampleMessages(frame)
        self._joint_states = conversion.JointStates(
            of['joint_names'], of['joint_states_rate'], frame, of['motor_torque_constant'])
        # a profile each: ROS writes into it what it is overridden with
        self._topics = [
            self.create_lifecycle_publisher(kind, name, sample_qos(
                of['sync_period'], of['block_size'], of['history']),
                qos_overriding_options=OVERRIDABLE)
            for name, kind in SAMPLES.items()]
        self._topics.append(self.create_lifecycle_publisher(
            JointState, 'joint_states', 10, qos_overriding_options=OVERRIDABLE))
        self._subscription = self.create_subscription(
            Command, 'command', self._take_command, sample_qos(of['sync_period'], 1, 1.0),
            qos_overriding_options=OVERRIDABLE)
        self._intake = CommandIntake(
            self._link, self._player, self._modes, self.health,
            CommandSources(self, self._subscription, self.health))
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """
        Let the link bring the rig up; it goes on trying until that is done.

        Fails while several publish commands, and where the link has stopped by an error.
        """
        if self._link.broken or self._several(self._link.now()):
            return FAILURE
        result = super().on_activate(state)
        self._leaps = EncoderLeaps(  # a shaft may have been turned by hand
            self.health, self._values['largest_acceleration'])
        self._link.start()
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Zero, disable, and stop sampling."""
        if not self._link.stop():
            self.get_logger().warning('the rig did not confirm that the drive is disabled')
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave the bus."""
        self._leave()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave the bus, whatever the state was."""
        self._led = True
        self._leave()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave the bus after a transition that broke, so that configure may be tried again."""
        self._leave()
        return SUCCESS

    def destroy_node(self) -> None:
        """Leave the bus, then the graph."""
        self._leave()
        super().destroy_node()

    def _make_link(self, of: dict) -> RigLink:
        contradiction = parameters.contradiction(of)
        if contradiction:
            raise parameters.Contradiction(contradiction)
        device, watch = PROTOCOLS[of['protocol']](of, self.health)
        bus = BusSettings(of['bus.interface'], of['bus.channel'], of['bus.bitrate'], device.fd)
        self._carried = device.carried()
        self._player = SetpointPlayer(of['command_timeout'], self._limits(of))
        self._modes = device.modes()
        master = DriveMaster(of['fault_resets'], of['fault_reset_pause'],
                             quick_stop=of['quick_stop_time'],
                             after_loss=of['enable_after_loss'])
        sampler = Sampler(device, self._player, master, watch, self.health,
                          round(of['answer_timeout'] * 1e9))
        settings = LinkSettings(round(of['sync_period'] * 1e9), of['block_size'],
                                of['late_sync_limit'], of['listen_time'], of['retry_period'],
                                of['realtime_priority'])
        return RigLink(settings, sampler, watch, self.health,
                       lambda: Wire(open_bus(bus, of['retry_period']), bus), self._publish,
                       self._ros_now)

    def _leave(self) -> None:
        link, self._link = self._link, None
        if link is None:
            return
        if not link.close():
            self.get_logger().error(f'the driver leaves the bus, and {NOT_DOWN}')
        self.health.over_all('', self._ros_now())  # it cannot know any more
        self.health.trouble('bus.closed', 'the bus is not open: the driver is not configured',
                            self._ros_now())
        for topic in self._topics:
            self.destroy_lifecycle_publisher(topic)
        self.destroy_subscription(self._subscription)
        self._topics, self._intake = [], None

    # Samples and commands.

    def _publish(self, block: SampleBlock) -> None:
        messages = self._messages.fill(block)
        state = self._joint_states.from_block(block, self._leaps.take(block))
        try:
            for topic, message in zip(self._topics[:3], messages, strict=True):
                topic.publish(message)
            if state is not None:
                self._topics[-1].publish(state)
        except Exception:
            if self.context.ok():
                raise

    def _take_command(self, message: Command) -> None:
        if self._intake is not None:
            self._intake.take(*conversion.command_of(message))

    def _several(self, now: int) -> bool:
        return self._intake is not None and self._intake.several(now)

    # Parameters.

    def _judge_parameters(self, changes: list[Parameter]):
        return parameters.judge(changes, self._values, self._link is not None)

    def _apply_parameters(self, changes: list[Parameter]) -> None:
        self._values = {**self._values, **{change.name: change.value for change in changes
                                           if change.name in self._values}}
        if self._player is not None:
            self._player.timeout = self._values['command_timeout']
            self._player.limits = self._limits(self._values)

    def _limits(self, of: dict) -> Limits:
        """Return the limits that hold, and say where they are not those that were given."""
        own = parameters.limits(of)
        held = own.within(self._carried)
        if held != own:
            self.health.event('command.limits', 'the frames of the drive do not carry '
                              f'{parameters.beyond(own, held)}; commands are held to what they '
                              'carry', self._ros_now())
        return held

    # Health.

    def _ros_now(self) -> int:
        return self.get_clock().now().nanoseconds

    def _look(self) -> None:
        now = self._link.now() if self._link else self._ros_now()
        if self._link is not None:
            self._link.look()
        self._several(now)
        if self._values['autostart'] and not self._led and not self.finished.done():
            self._start_by_itself(now)
        self.diagnoser.look(now, self._values['diagnostics_period'])

    def _start_by_itself(self, now: int) -> None:
        label = self._state_machine.current_state[1]
        since = abs(now - self._tried_at)  # ROS time may have been set back
        if label == 'unconfigured' and since > self._values['retry_period'] * 1e9 and (
                self._namesake.alone(self._values['graph_listen_time'])):
            if self.trigger_configure() == SUCCESS:
                self.trigger_activate()
            self._tried_at = self._ros_now()  # a try may take longer than the pause between two

    def _give_way(self, why: str) -> None:
        self.health.trouble('bus.namesake', why, self._ros_now())
        if not self.finished.done():
            self.finished.set_result(why)

    def _facts(self) -> dict[str, str]:
        link = self._link
        facts = {PROCESS: self._namesake.process, 'state': link.state if link else 'closed',
                 'lifecycle': self._state_machine.current_state[1]}
        if link is None:
            return facts
        facts['drive'] = link.sampler.master.state.words
        facts['fault resets'] = str(link.sampler.master.tries)
        facts['samples'] = str(link.sampler.samples)
        facts['latest SYNC'] = f'{link.requests.latest * 1e-6:.3f} ms'
        facts |= {f'readers of {topic.topic_name.rpartition("/")[2]}':
                  str(topic.get_subscription_count()) for topic in self._topics}
        facts['set-points waiting'] = str(self._player.waiting)
        facts['command'] = 'playing' if self._player.playing else 'none, motor at zero'
        link.requests.latest = 0
        return facts


def main(arguments: list[str] | None = None) -> int:
    """
    Run the driver until told to stop; 1: another has the bus or the name, 2: a bad parameter.

    ROS stays up until the drive is down, whatever signals come meanwhile.
    """
    if asked_for_help('driver', __doc__, 'config/driver.yaml'):
        return 0
    free_output()
    sys.setswitchinterval(5e-4)
    ending = Ending()
    start_ros(arguments)
    try:
        node = Driver()
    except (*UNFIT, parameters.Contradiction) as error:
        return cannot_start('driver', error)
    executor = EventsExecutor()
    executor.add_node(node)
    try:
        ending.spin(executor, node.finished)
    finally:
        refused = node.finished.done()
        if refused:
            node.diagnoser.say_goodbye(node.get_clock().now().nanoseconds)
        node.destroy_node()
        rclpy.try_shutdown()
    return int(refused)


if __name__ == '__main__':
    raise SystemExit(main())
