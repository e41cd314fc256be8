"""Messages of the driver: the only file of it, besides the node, that touches them."""

from __future__ import annotations

from array import array
from datetime import datetime, UTC

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import JointState

from servo_twin_msgs.msg import Command, Current, Encoder, Torque

from .encoder_leaps import EncoderLeaps
from .rig_health import Level, RigHealth, Trouble
from .sample_blocks import SampleBlock

SECOND = 1_000_000_000
GROUPS = ('bus', 'nodes', 'drive', 'samples', 'command')
"""Parts of the rig's health, one DiagnosticStatus each; a trouble's key begins with one."""


def to_time(instant: int) -> Time:
    """Return an instant in ns as a message."""
    return Time(sec=instant // SECOND, nanosec=instant % SECOND)


def to_instant(stamp: Time) -> int:
    """Return a stamp as ns."""
    return stamp.sec * SECOND + stamp.nanosec


class SampleMessages:
    """
    The three messages of a block of samples, made once and filled again and again.

    Filling costs a third of making; what fill() returns holds until it is called again.
    """

    _ARRAYS = (('motor_position', 'load_position'), ('torque', 'external_torque'),
               ('current', 'voltage', 'current_reference', 'reference_velocity',
                'reference_position', 'temperature'))

    def __init__(self, frame: str) -> None:
        self.frame = frame
        self._messages = Encoder(), Torque(), Current()
        self._stamp = Time()
        for message in self._messages:
            message.header.stamp = self._stamp
            message.header.frame_id = frame

    def fill(self, block: SampleBlock) -> tuple[Encoder, Torque, Current]:
        """Return the messages of a block."""
        self._stamp.sec, self._stamp.nanosec = divmod(block.stamp, SECOND)
        for message, names in zip(self._messages, self._ARRAYS, strict=True):
            message.sequence = block.sequence
            message.period = block.period
            for name in names:
                setattr(message, name, block.columns[name])
        return self._messages


class JointStates:
    """
    Thins blocks out to at most ``rate`` joint states a second, for people's tools.

    The velocity of a state is the mean since the one before it, NaN where the angle has leapt
    meanwhile; 0 Hz makes none. The effort of the
    load is the measured torque, that of the motor the current times ``torque_constant``, N m/A;
    0: not known, NaN.
    """

    def __init__(self, names: list[str], rate: float, frame: str,
                 torque_constant: float = 0.0) -> None:
        self.names = list(names)
        self.pause = SECOND / rate if rate > 0.0 else None
        self.frame = frame
        self.torque_constant = torque_constant or float('nan')
        self._before: tuple[int, float, float] | None = None
        self._leapt: frozenset[str] = frozenset()

    def from_block(self, block: SampleBlock, leapt: frozenset[str] = frozenset()
                   ) -> JointState | None:
        """
        Return the state at the last sample of a block, None when it is not yet time.

        ``leapt`` names the angles that leapt within the block.
        """
        self._leapt |= leapt
        last = len(block.columns['torque']) - 1
        instant = block.stamp + round(last * block.period * SECOND)
        if self.pause is None or (self._before and instant - self._before[0] < self.pause):
            return None
        here = block.columns['motor_position'][last], block.columns['load_position'][last]
        velocity = [float('nan')] * 2
        if self._before:
            elapsed = (instant - self._before[0]) / SECOND
            velocity = [float('nan') if name in self._leapt else (now - then) / elapsed
                        for name, now, then in zip(EncoderLeaps.ANGLES, here, self._before[1:],
                                                   strict=True)]
        self._before, self._leapt = (instant, *here), frozenset()
        state = JointState(name=self.names, position=array('d', here), velocity=velocity,
                           effort=[self.torque_constant * block.columns['current'][last],
                                   block.columns['torque'][last]])
        state.header.stamp = to_time(instant)
        state.header.frame_id = self.frame
        return state


def command_of(message: Command) -> tuple[int, int, float, array, array]:
    """Return (start in ns, mode, period in s, references, external torques) of a command."""
    return (to_instant(message.header.stamp), message.mode, message.period, message.reference,
            message.external_torque)


def to_diagnostics(node: str, health: RigHealth, facts: dict[str, str], now: int,
                   groups: tuple[str, ...] = GROUPS) -> DiagnosticArray:
    """
    Return the health of the rig: one status for the whole, then one for each of ``groups``.

    ``facts`` go into the first one as key and value, the counters into that of their group, and
    what passed lately into the first one as 'past 1', 'past 2', ...
    """
    lasting = health.troubles
    said = DiagnosticArray()
    said.header.stamp = to_time(now)
    whole = _status(f'{node}: rig', lasting, facts.get('state', ''), now)
    whole.values = [KeyValue(key=key, value=value) for key, value in facts.items()]
    for number, trouble in enumerate(health.past, 1):
        whole.values.append(KeyValue(key=f'past {number}', value=(
            f'{trouble.text} (from {_utc(trouble.since)} to {_utc(trouble.until)})')))
    said.status.append(whole)
    counters = health.counters
    for group in groups:
        status = _status(f'{node}: {group}', [trouble for trouble in lasting
                                              if trouble.key.startswith(f'{group}.')], 'ok', now)
        status.values = [KeyValue(key=key.removeprefix(f'{group}.'), value=str(number))
                         for key, number in sorted(counters.items())
                         if key.startswith(f'{group}.')]
        said.status.append(status)
    return said


def _status(name: str, troubles: list[Trouble] | tuple[Trouble, ...], else_: str, now: int
            ) -> DiagnosticStatus:
    level = max((trouble.level for trouble in troubles), default=Level.OK)
    told = '; '.join(f'{trouble.text}, since {_utc(trouble.since)} '
                     f'({(now - trouble.since) / SECOND:.1f} s)' for trouble in troubles)
    return DiagnosticStatus(name=name, hardware_id=name.split(':')[0], level=bytes([level]),
                            message=told or else_)


def _utc(instant: int) -> str:
    moment = datetime.fromtimestamp(instant / SECOND, tz=UTC)
    return moment.isoformat(timespec='milliseconds').replace('+00:00', 'Z')
