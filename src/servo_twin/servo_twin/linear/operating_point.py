"""Where a servo is made linear: the operating point, and what of the servo has no linear part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..physics import state
from ..physics.kernel import kernel_of
from ..physics.servo import Servo, ServoError
from ..physics.servo_parts import DigitalDrive
from ..physics.simulate import initial_state, ROOM_TEMPERATURE
from ..physics.state import INPUTS
from .signal_names import FRICTIONS

_PERIODIC = 'repeats with the angle, so that its slope is another one at each angle'
_ROUNDING = 'rounds: it has no slope, and acts as noise'
_LOOPS = 'depends on the way that the torsion came, not on its value'
WITHOUT_SLOPE = {
    'cogging': _PERIODIC, 'torque_ripple': _PERIODIC, 'transmission_error': _PERIODIC,
    'kinematic_error': _PERIODIC, 'load_encoder_eccentricity': _PERIODIC,
    'encoder_counts': _ROUNDING,
    'drive_dead_band': 'the command is taken to be outside the band, where the slope is 1',
    'network_deviation': 'follows the reference too; what is made linear is the model below it',
    'hysteresis': _LOOPS, 'dahl_hysteresis': _LOOPS,
}
"""Effects that the linear form leaves out, and why; those of the port `clearance` besides."""

_CLEARANCE = 'the teeth are taken to touch; within the gap there is no torque'
_RUBBING = ('dahl_friction', 'presliding_friction')
_DEAD_TIMES = ('command_delay', 'sensor_delay')
_SETTLING = 2000  # steps in which the laws' memories come to rest at the operating point
_TRIES = 8


@dataclass(frozen=True)
class Point:
    """
    Where the servo is made linear.

    ``speed`` is in rad/s of the load (m/s of a linear axis); ``angle`` of the load in rad;
    ``torque`` is the external torque on the load in N m; ``coupled`` the angle in rad of an axis
    that changes the inertia of this one; ``temperature`` is in degC. ``friction``: `sliding`: both
    shafts move at ``speed`` and friction is its slope there, a constant being balanced by the
    command; `none`: no friction at all; `stuck`: friction holds the load fast, and the motor,
    without friction, turns against the transmission.
    """

    friction: str = 'sliding'
    speed: float = 0.0
    angle: float = 0.0
    torque: float = 0.0
    coupled: float = 0.0
    temperature: float = ROOM_TEMPERATURE


def usual_point(servo: Servo, friction: str = 'sliding', speed: float | None = None,
                angle: float = 0.0, torque: float = 0.0, coupled: float = 0.0) -> Point:
    """Return a point whose speed, where none is given, is 1 rad/s (0.1 m/s) while sliding."""
    if friction not in FRICTIONS:
        raise ServoError(f'there is no friction {friction!r}; there are {list(FRICTIONS)}')
    if speed is None:
        speed = 0.0 if friction != 'sliding' else 0.1 if servo.linear else 1.0
    return Point(friction, speed, angle, torque, coupled)


class Still:
    """
    A servo held at an operating point, with what has no linear part switched off.

    ``x`` is the state there and ``u`` the row of inputs that keeps it, whose command ``command``
    (V) or current balances all constant torques; ``left_out`` maps placed effects to the reason
    why they are not in, ``dead`` maps sites (`command` and channels) to dead times in s.
    ``forced``: the motor current is the input. Raises ServoError where nothing can move.
    """

    def __init__(self, servo: Servo, point: Point, forced: bool = False) -> None:
        self.servo, self.point = servo, point
        self.kernel, self.theta, self.on = kernel_of(servo), servo.theta, servo.switches
        self._mode = state.FORCED_CURRENT if forced else state.MEASURED_INPUT
        self._given = state.MEASURED_CURRENT if forced else state.VOLTAGE
        self.left_out: dict[str, str] = {}
        self.dead: dict[str, float] = {}
        self._strip()
        self._find()

    def step(self, x: np.ndarray, u: np.ndarray, h: float) -> np.ndarray:
        """Return the state h s after ``x`` under the inputs ``u``, shape (len(INPUTS),)."""
        x = self._begun_anew(x)
        self.kernel.run(self.theta, self.on, x, u[None], np.empty((1, 5)), 1, h, self._mode)
        return x

    def read(self, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return what the four sensors read of a state, shape (4,), as OUTPUTS."""
        y = np.empty((1, 5))
        self.kernel.run(self.theta, self.on, self._begun_anew(x), u[None], y, 1, 1e-9, self._mode)
        return y[0, :4]

    def live(self) -> list[int]:
        """Return the indices of the state that a linear form may be made of."""
        kept = [state.MOTOR_ANGLE, state.MOTOR_SPEED, state.LOAD_ANGLE, state.LOAD_SPEED,
                state.CURRENT, state.TORQUE]
        if self.point.friction == 'stuck':
            kept = [i for i in kept if i not in (state.LOAD_ANGLE, state.LOAD_SPEED)]
        for (_, slot), live in zip(self.memories(), self.remembers(), strict=True):
            if live:
                kept += range(slot.start, slot.stop)
        return kept

    def memories(self) -> list[tuple[str, slice]]:
        """Return drive, mechanism and effects by name, and where their memory stands."""
        return [(path.removeprefix('effects.'), slot)
                for path, slot in self.servo.memories().items()]

    def remembers(self) -> list[bool]:
        """Return whether each of `memories` takes part in the linear form."""
        off = {'drive'} if issubclass(self.servo.drive, DigitalDrive) else set()
        off |= set() if self.servo.mechanism.correctable else {'mechanism'}
        off |= set(self.left_out)
        off |= {p.name for p in self.servo.effects if p.effect.name in _DEAD_TIMES}
        return [owner not in off for owner, _ in self.memories()]

    def _begun_anew(self, x: np.ndarray) -> np.ndarray:
        """Return a copy of a state; a mechanism beside the kernel begins at it, not before."""
        x = x.copy()
        if not self.servo.mechanism.correctable:
            x[self.servo.memories()['mechanism']] = 0.0
        return x

    def _strip(self) -> None:
        slots = self.servo.slots()
        for i, placed in enumerate(self.servo.effects):
            name, why = placed.effect.name, WITHOUT_SLOPE.get(placed.effect.name)
            if placed.effect.port == 'clearance':
                why = _CLEARANCE
            rubs = placed.effect.port == 'friction' or name in _RUBBING
            if rubs and self.point.friction != 'sliding':
                why = f'friction is {self.point.friction}'
            if name in _DEAD_TIMES:
                slot = slots[f'effects.{placed.name}.delay']
                before = self.dead.get(placed.site, 0.0)
                self.dead[placed.site] = before + float(self.theta[slot.start])
                self.theta[slot] = 0.0
            elif why:
                self.left_out[placed.name] = why
                self.on[i] = False

    def _find(self) -> None:
        """Find the inputs and the state of steady motion, by Newton's method."""
        point, servo = self.point, self.servo
        if issubclass(servo.drive, DigitalDrive) and self._given == state.VOLTAGE:
            raise ServoError(f'{servo.name}: the loops of its drive have cycles of their own and '
                             f'no continuous linear form; take the input current')
        if not servo.mechanism.restartable:
            raise ServoError(f'{servo.name}: its FMU has no linear form: it must take any step, '
                             f'and mechanism.start must map both angles and both speeds, so that '
                             f'it can be begun anywhere')
        if point.friction == 'stuck' and not servo.mechanism.compliant:
            raise ServoError(f'{servo.name}: friction stuck: a {servo.mechanism.name} mechanism '
                             f'cannot move while its load sticks; there are sliding and none')
        if point.friction == 'sliding' and point.speed == 0.0 and any(
                p.effect.port == 'friction' and on
                for p, on in zip(servo.effects, self.on, strict=True)):
            raise ServoError(f'{servo.name}: at a speed of 0 friction holds the shafts and '
                             f'nothing moves; give a speed, or friction none or stuck')
        wanted = np.array([point.torque, 0.0])
        for _ in range(_TRIES):
            wrong = self._unrest(wanted)
            if np.abs(wrong).max() < 1e-6 * max(1.0, abs(point.speed)):
                break
            slope = np.empty((2, 2))
            for j in range(2):
                moved = wanted.copy()
                moved[j] += (change := 1e-3 * max(1.0, abs(wanted[j])))
                slope[:, j] = (self._unrest(moved) - wrong) / change
            scale = np.maximum(np.abs(slope).max(axis=1), 1e-300)
            wanted -= np.linalg.lstsq(slope / scale[:, None], wrong / scale, rcond=1e-12)[0]
        self._unrest(wanted)
        self.command, self.carried = float(wanted[1]), float(self.x[state.TORQUE])
        if not np.isfinite(self.x[self.live()]).all():
            raise ServoError(f'{servo.name}: no steady motion was found at {point}')

    def _unrest(self, wanted: np.ndarray) -> np.ndarray:
        """Return both accelerations while the mesh was laid to ``wanted[0]``, input as given."""
        torque, given = wanted
        u = np.zeros(len(INPUTS))
        u[state.EXTERNAL], u[state.TEMPERATURE] = self.point.torque, self.point.temperature
        u[state.MEASURED_MOTOR] = u[state.MEASURED_LOAD] = np.nan
        u[state.COUPLED_POSITION] = self.point.coupled
        u[self._given] = given
        x = initial_state(self.servo, np.nan, self.point.angle, torque, self.point.speed,
                          self.theta, self.on)
        held, live = x[:state.CURRENT].copy(), self.live()
        h = self.servo.step
        for _ in range(_SETTLING):
            before = x[live]
            x = self.step(x, u, h)
            x[:state.CURRENT] = held
            if np.allclose(x[live], before, 1e-12, 1e-14):
                break
        self.x, self.u = x, u
        h = 1e-7
        gained = (self.step(x, u, h) - x)[[state.MOTOR_SPEED, state.LOAD_SPEED]] / h
        if self.point.friction == 'stuck':
            gained[1] = 0.0
        return gained
