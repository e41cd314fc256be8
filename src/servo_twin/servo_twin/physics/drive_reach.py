"""How much torque the limits of a servo file leave its drive, at each speed."""

from __future__ import annotations

from math import sqrt
from types import SimpleNamespace

from .plain_laws import acts_at, Plain, uncompiled
from .servo import Placed, Servo
from .servo_parts import DigitalDrive

_UNLIMITED = 1e9  # V: a command that nothing limits, and near enough for limits not to round off
_LONG = 1e9  # s: beyond all that a drive takes to reach its current


class Reach:
    """
    What the drive of a servo can do at most, by its own limits and those of the controller.

    Of a servo that limits neither command nor current, and of one whose limits are not ``known``,
    ``limited`` is False. What is recorded may go beyond: a command by hand, a push on the load.
    """

    def __init__(self, servo: Servo, known: bool = True) -> None:
        self._servo = servo
        self._path = {site: [Plain(servo, placed) for placed in servo.effects
                             if acts_at(placed, 'drive', site) and not placed.effect.memory]
                      for site in ('command', 'current')}
        self._values = SimpleNamespace(**{name.partition('.')[2]: value
                                          for name, value in servo.numbers.items()
                                          if name.startswith('drive.')})
        own = servo.drive.law  # type: ignore[attr-defined]  # each has its own signature
        law = None if issubclass(servo.drive, DigitalDrive) else uncompiled(own)
        self._constant = servo.numbers['drive.torque_constant']
        self._law, self._command = law, min(_most_command(servo), _UNLIMITED)
        self.current = self._current(0.0)
        """The largest current of a motor that is held, A."""
        more = self._current(0.0, 2.0) > 1.5 * self.current
        self.limited = known and not (self._command == _UNLIMITED and more)

    def push(self, speed: float) -> float:
        """Return the most torque on the motor (N m) with its motion at a speed (rad/s) >= 0."""
        fastest = self._servo.numbers.get('controller.speed_limit')
        if fastest is not None and speed > fastest * self._servo.numbers['mechanism.ratio']:
            return 0.0
        return max(0.0, self._constant * self._current(speed))

    def _current(self, speed: float, share: float = 1.0) -> float:
        """Return the largest current that goes with a motion, A, by a share of the command."""
        found = []
        for way in (1.0, -1.0):
            turned = way if getattr(self._values, 'gain', 1.0) >= 0.0 else -way
            command = self._through('command', share * turned * self._command, way * speed)
            found.append(way * self._through('current', self._drive(command, way * speed),
                                             way * speed))
        return max(found)

    def _through(self, site: str, value: float, speed: float) -> float:
        for law in self._path[site]:
            value = law(value=value, speed=speed)
        return value

    def _drive(self, command: float, speed: float) -> float:
        """Return the current that a drive comes to in the end, A."""
        p = self._values
        if self._law is not None:
            return self._law(p, 0.0, command, speed, _LONG)
        # one with loops of its own has all of its current up to its speed and its voltage
        way = 1.0 if command >= 0.0 else -1.0
        fast = abs(speed) > abs(p.speed_gain * command) or (
            p.torque_constant / 1.5 * abs(speed) > p.bus_voltage / sqrt(3.0))
        return 0.0 if fast else way * p.current_limit


def _most_command(servo: Servo) -> float:
    """Return the largest command of a controller, V; that of a recording has no limit."""
    numbers = servo.numbers
    if 'controller.torque_limit' in numbers:
        return numbers['controller.torque_limit'] / numbers['controller.command_torque']
    return numbers.get('controller.limit', _UNLIMITED)


def largest_torsion(servo: Servo, meshes: list[Placed], torque: float) -> float:
    """Return the torsion, rad at the load, at which the mesh carries a torque, N m at the load."""
    laws = [Plain(servo, placed) for placed in meshes if not placed.effect.memory]
    stiffness = servo.numbers['mechanism.stiffness']

    def carries(angle: float) -> bool:
        return min(way * (stiffness * way * angle + sum(law(angle=way * angle) for law in laws))
                   for way in (1.0, -1.0)) >= torque

    low, high = 0.0, 2.0 * torque / stiffness  # what softens more than by half is asked no further
    if not carries(high):
        return high
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if carries(middle) else (middle, high)
    return high
