"""The driver's parameters: each declared here once, with default, unit, range and meaning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.lifecycle import LifecycleNode
from rclpy.parameter import Parameter

from ..can_bus.bus_opening import BusSettings, INTERFACES
from ..devices.object_dictionary import NODE_IDS
from ..devices.protocols import PROTOCOLS
from .encoder_leaps import FASTEST, MEANING
from .limits import Limits

PERIODS = 3
"""How often a drive that is asked for each sample is to be asked within its watchdog, at least."""


class Contradiction(ValueError):
    """Parameters that are each in range and cannot all hold."""


@dataclass(frozen=True)
class Declared:
    """One parameter; ``live`` ones act at once, the others when the node is configured."""

    name: str
    default: Any
    unit: str
    text: str
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    live: bool = False

    def descriptor(self) -> ParameterDescriptor:
        """Return the ROS descriptor; ROS itself refuses what lies outside its range."""
        unit = f' [{self.unit}]' if self.unit else ''
        told = ParameterDescriptor(description=f'{self.text}{unit}')
        if self.choices:
            told.additional_constraints = f'one of {list(self.choices)}'
        if self.low is not None and isinstance(self.default, float):
            told.floating_point_range = [
                FloatingPointRange(from_value=float(self.low), to_value=float(self.high))]
        elif self.low is not None:
            told.integer_range = [
                IntegerRange(from_value=int(self.low), to_value=int(self.high), step=1)]
        return told


DECLARED = (
    Declared('bus.interface', 'unix_bus', '', 'python-can interface: unix_bus between processes '
             'of one machine, socketcan for hardware, virtual within a process',
             choices=INTERFACES),
    Declared('bus.channel', BusSettings().channel, '', 'Channel of the interface: the path of the '
             "hub's socket, can0, or a name"),
    Declared('bus.bitrate', 1_000_000, 'bit/s', 'Bit rate, for interfaces that set one',
             10_000, 1_000_000),
    Declared('protocol', 'canopen', '', 'What the drive speaks: CiA 402 over CANopen, ODrive CAN '
             'Simple, MIT mode (RobStride, CyberGear, CubeMars), or moteus registers',
             choices=tuple(PROTOCOLS)),
    Declared('dictionaries', 'rv_bench', '', 'Object dictionaries of the three nodes: a shipped '
             'set or a folder with drive.eds, load_encoder.eds and torque_sensor.eds'),
    Declared('nodes.drive', 1, '', 'CANopen node id of the drive', 1, 126),
    Declared('nodes.load_encoder', 2, '', 'CANopen node id of the load encoder', 1, 126),
    Declared('nodes.torque_sensor', 3, '', 'CANopen node id of the torque sensor and load '
             'simulator', 1, 126),
    Declared('nodes.driver', 127, '', 'CANopen node id under which the driver beats its own heart',
             1, 127),
    Declared('device.table', '', '', 'For all protocols but canopen: a shipped table of frames, '
             'or a file; scales and ranges stand there'),
    Declared('device.id', 1, '', 'Id of the drive on the bus', 0, 127),
    Declared('device.host', 0, '', 'Id under which the driver speaks, and to which a drive in MIT '
             'mode or moteus answers', 0, 255),
    Declared('device.ratio', 0.0, '', 'Turns of the motor for one of the load; must be given',
             0.0, 1e4),
    Declared('device.torque_constant', 0.0, 'N m/A', 'Torque of the motor for one ampere, before '
             'the gear; must be given', 0.0, 1e3),
    Declared('device.kp', 0.0, 'N m/rad', 'Position gain at the load that goes with each position '
             'command, in MIT mode', 0.0, 1e6),
    Declared('device.kd', 0.0, 'N m s/rad', 'Speed gain at the load that goes with each position '
             'and velocity command, in MIT mode', 0.0, 1e6),
    Declared('device.brake', 0.0, 'N m s/rad', 'Speed gain at the load of a quick stop, in MIT '
             'mode', 0.0, 1e6),
    Declared('device.rest_speed', 0.1, 'rad/s', 'Speed at the load at which a quick stop is over '
             'and the torque is taken away', 1e-6, 1e3),
    Declared('device.watchdog', 0.1, 's', 'After what silence the drive stops by itself; told to '
             'moteus and RobStride, to be set by hand in others', 0.005, 10.0),
    Declared('answer_timeout', 1.0, 's', 'How long a drive that is asked for each sample may be '
             'behind with its answers before it is asked no more, until it has caught up or is '
             'silent; one sync_period for hardware', 1e-4, 1.0),
    Declared('sync_period', 1e-3, 's', 'Time from one SYNC, and sample, to the next', 1e-4, 0.1),
    Declared('block_size', 1, 'samples', 'Samples that travel in one message', 1, 4096),
    Declared('late_sync_limit', 0.5, 's', 'A SYNC later than this is left out, and its sample '
             'with it; half a sync_period for hardware', 0.0, 10.0),
    Declared('realtime_priority', 0, '', 'SCHED_FIFO priority of the thread that paces SYNC; 0: '
             'none. Needs the right to set it (CAP_SYS_NICE, or rtprio in limits.conf)', 0, 99),
    Declared('largest_acceleration', FASTEST, 'rad/s^2', MEANING, 1.0, 1e7),
    Declared('joint_states_rate', 50.0, 'Hz', 'At most this many joint_states a second; 0: none',
             0.0, 1000.0),
    Declared('joint_names', ['motor', 'load'], '', 'Names of the two joints in joint_states'),
    Declared('motor_torque_constant', 0.0, 'N m/A', 'Of the motor: times the current it is the '
             'effort of the motor joint in joint_states; 0: not known, the effort is NaN',
             0.0, 1e4),
    Declared('frame_id', '', '', 'TF frame of the samples: what the bench stands on; empty: '
             'base_link below the namespace of the node'),
    Declared('command_timeout', 0.1, 's', 'No set-point older than this reaches the motor; the '
             "age counts from the set-point's own instant", 1e-3, 10.0, live=True),
    Declared('limit.voltage', 10.0, 'V', 'Largest voltage command in size', 0.0, 1000.0,
             live=True),
    Declared('limit.current', 5.0, 'A', 'Largest current command in size', 0.0, 1000.0,
             live=True),
    Declared('limit.velocity', 2.0, 'rad/s', 'Largest load velocity command in size', 0.0, 1000.0,
             live=True),
    Declared('limit.position_lower', -6.3, 'rad', 'Smallest load position command', -1e6, 1e6,
             live=True),
    Declared('limit.position_upper', 6.3, 'rad', 'Largest load position command', -1e6, 1e6,
             live=True),
    Declared('limit.external_torque', 1000.0, 'N m', 'Largest torque of the load simulator in '
             'size', 0.0, 1e6, live=True),
    Declared('heartbeat_timeout', 0.5, 's', 'A node not heard for so long is lost', 0.02, 30.0),
    Declared('listen_time', 0.3, 's', 'How long to listen for another driver before speaking',
             0.05, 10.0),
    Declared('graph_listen_time', 3.3, 's', 'How long to look for another driver of the same full '
             'name before starting by itself; DDS announces a process every 3 s', 0.0, 60.0),
    Declared('retry_period', 0.5, 's', 'Time between two tries to reach the bus or the rig',
             0.05, 60.0),
    Declared('fault_resets', 5, '', 'Fault resets before the drive is given up; forgiven after '
             '10 s enabled', 0, 1000),
    Declared('fault_reset_pause', 0.5, 's', 'Time before each fault reset', 0.02, 60.0),
    Declared('enable_after_loss', False, '', 'Enable a drive again by itself that has started '
             'again, was silent for heartbeat_timeout or reported under-voltage: an emergency '
             'stop may have cut its supply'),
    Declared('quick_stop_time', 0.5, 's', 'How long the drive may brake by a quick stop before '
             'its torque is taken away, when it is deactivated or the driver ends', 0.0, 5.0),
    Declared('diagnostics_period', 1.0, 's', 'Time between two /diagnostics; a change is told at '
             'once. Others of the same name listen for them', 0.05, 1.0),
    Declared('history', 2.0, 's', 'How much the sample topics keep for a slow reader; at least '
             '1000 messages', 1.0, 60.0),
    Declared('autostart', False, '', 'Configure and activate once at the start, without a '
             'lifecycle manager; after the first transition the driver is led by hand only',
             live=True),
)
_BY_NAME = {declared.name: declared for declared in DECLARED}


def declare(node: LifecycleNode) -> None:
    """Declare all parameters of the driver on a node."""
    for declared in DECLARED:
        node.declare_parameter(declared.name, declared.default, declared.descriptor())


def refuse_simulated_time(node: LifecycleNode) -> None:
    """Raise Contradiction where a driver was told to follow the clock of a simulation."""
    reason = _simulated(node.get_parameter('use_sim_time').value)
    if reason:
        raise Contradiction(reason)


def _simulated(use_sim_time: bool) -> str:
    return ('use_sim_time = true: a driver samples a rig in real time, so leave it false here; '
            'twin and recorder may follow the clock of a simulation') if use_sim_time else ''


def values(node: LifecycleNode) -> dict[str, Any]:
    """Return all parameters by name."""
    return {declared.name: node.get_parameter(declared.name).value for declared in DECLARED}


def limits(of: dict[str, Any]) -> Limits:
    """Return the limits among the values of :func:`values`."""
    return Limits(of['limit.voltage'], of['limit.current'], of['limit.velocity'],
                  of['limit.position_lower'], of['limit.position_upper'],
                  of['limit.external_torque'])


def beyond(own: Limits, carried: Limits) -> str:
    """Return which limits are beyond what a drive's frames carry, in words; empty for none."""
    names = {'position_lower': 'lower', 'position_upper': 'upper'}
    pairs = {name: (getattr(own, names.get(name, name)), getattr(carried, names.get(name, name)))
             for name in ('voltage', 'current', 'velocity', *names)}
    return ', '.join(f'limit.{name} = {given:g} {_BY_NAME[f"limit.{name}"].unit} (it carries '
                     f'{most:g})' for name, (given, most) in pairs.items() if given != most)


def judge(changes: list[Parameter], now: dict[str, Any], configured: bool) -> SetParametersResult:
    """Judge a change of parameters; ``now`` are the values before it. Applies nothing."""
    then = dict(now)
    for change in changes:
        declared = _BY_NAME.get(change.name)
        if change.name == 'use_sim_time' and change.value:
            return SetParametersResult(successful=False, reason=_simulated(change.value))
        if declared is None:
            continue
        if configured and not declared.live and change.value != now[change.name]:
            return SetParametersResult(successful=False, reason=(
                f'{change.name} takes effect at configure; clean the node up first'))
        then[change.name] = change.value
    reason = contradiction(then)
    return SetParametersResult(successful=not reason, reason=reason)


def contradiction(of: dict[str, Any]) -> str:
    """
    Return what parameters say against each other or their choices, empty when nothing.

    ROS itself refuses what is out of a range.
    """
    for declared in DECLARED:
        if declared.choices and of[declared.name] not in declared.choices:
            return (f'{declared.name} = {of[declared.name]!r}; it is one of '
                    f'{list(declared.choices)}')
    if of['limit.position_lower'] > of['limit.position_upper']:
        return (f"limit.position_lower = {of['limit.position_lower']} rad is above "
                f"limit.position_upper = {of['limit.position_upper']} rad")
    if len(of['joint_names']) != 2 or len({'', *of['joint_names']}) != 3:
        return (f"joint_names = {list(of['joint_names'])}; it holds two names that differ, motor "
                'and load')
    periods = round(of['device.watchdog'] / of['sync_period'], 6)
    if of['protocol'] != 'canopen' and periods < PERIODS:
        return (f"device.watchdog = {of['device.watchdog']:g} s is less than {PERIODS} times "
                f"sync_period = {of['sync_period']:g} s; the drive would stop between two "
                'requests, and few set-points would go out')
    if of['protocol'] == 'mit':
        for gain in ('kd', 'brake'):
            if not of[f'device.{gain}'] > 0.0:
                return (f"device.{gain} = {of[f'device.{gain}']:g} N m s/rad; a drive in MIT mode "
                        'needs one above 0: it has no speed loop or quick stop of its own')
    micros = of['sync_period'] * 1e6
    if abs(micros - round(micros)) > 1e-6:
        return (f"sync_period = {of['sync_period']} s; the nodes count it in microseconds (object "
                '1006h), so give a multiple of 1e-06 s')
    nodes = [of[f'nodes.{who}'] for who in (*NODE_IDS, 'driver')]
    if len(set(nodes)) != len(nodes):
        return f'nodes.drive, .load_encoder, .torque_sensor, .driver = {nodes}; all must differ'
    return ''
