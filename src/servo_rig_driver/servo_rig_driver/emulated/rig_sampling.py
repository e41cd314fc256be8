"""
What happens at a SYNC: sensors are latched, the drive's loops run once, the command is held.

The compiled entry points of the emulator are here: `answer` a SYNC, `advance` to the next one, and
`record`, both in a row for a whole recording. They are cached by numba and keyed by the sources of
all laws, so that an edited law is compiled again.
"""

from __future__ import annotations

from hashlib import sha256
from math import atan2, ceil, cos, exp, floor, nan, pi, sin
from pathlib import Path

import numba as nb

from . import substeps
from .motor_current import delayed
from .rig_state import fresh_state

__all__ = ['advance', 'answer', 'fresh_state', 'record']

# columns of a command, of the noise (standard normal) and of an answer
MODE, REFERENCE, EXTERNAL, SPEED_REFERENCE, KP, KD, FEED_FORWARD = range(7)
NOISES = 6
(MOTOR, LOAD, SPEED, TORQUE, CURRENT, TEMPERATURE, EXTERNAL_NOW, VOLTAGE,
 CURRENT_REFERENCE) = range(9)
ANSWERS = 9
OFF, VOLTAGE_MODE, CURRENT_MODE, VELOCITY_MODE, POSITION_MODE = 0.0, 1.0, 2.0, 3.0, 4.0
IMPEDANCE_MODE = 5.0  # REFERENCE is the position, rad at the load; the others are used in it alone

_advance = substeps.advance


@nb.njit
def _eccentric(angle, offset):
    """Return what an encoder reads whose disc sits off centre by ``offset`` of its radius."""
    if offset == 0.0:
        return angle
    return angle + atan2(offset * sin(angle), 1.0 - offset * cos(angle))


@nb.njit
def _counted(angle, counts, scale):
    """Return an angle in whole encoder steps."""
    if scale == 0.0:
        return angle
    step = 2.0 * pi / counts * scale
    return floor(angle / step + 0.5) * step


@nb.njit
def _latch(P, S, period, h, noise, out):
    quiet = P.sensors_noise
    out[MOTOR] = _counted(_eccentric(S.motor_angle, P.withheld_motor_eccentricity)
                          + quiet * P.sensors_motor_noise * noise[0],
                          P.sensors_motor_counts, P.sensors_counts)
    if P.sensors_load_encoder > 0.0:
        angle = S.load_angle
        if P.withheld_load_sensor_delay > 0.0:
            angle = delayed(S.load_angles, S.at, P.withheld_load_sensor_delay / h)
        out[LOAD] = _counted(_eccentric(angle, P.withheld_load_eccentricity)
                             + quiet * P.sensors_load_noise * noise[1],
                             P.sensors_load_counts, P.sensors_counts)
    else:
        out[LOAD] = nan
    S.torque_zero += P.sensors_wander * P.sensors_torque_wander * period ** 0.5 * noise[2]
    out[TORQUE] = (S.torque_reading * (1.0 + P.withheld_torque_sensor_gain)
                   + P.withheld_torque_sensor_offset + S.torque_zero
                   + quiet * P.sensors_torque_noise * noise[3])
    if P.sensors_torque == 0.0:
        out[TORQUE] = nan
    out[CURRENT] = (S.current * (1.0 + P.withheld_current_sensor_gain)
                    + P.withheld_current_sensor_offset
                    + quiet * P.sensors_current_noise * noise[4])
    out[TEMPERATURE] = S.temperature + quiet * P.sensors_temperature_noise * noise[5]
    out[EXTERNAL_NOW] = S.external


@nb.njit
def _loops(P, S, period, command, out):
    """Return the command, V, that the drive's loops make of the readings in ``out``."""
    angle = out[MOTOR] / P.machine_ratio
    if S.started == 0.0:
        S.started, S.last_angle = 1.0, angle
    keep = exp(-period / P.drive_velocity_filter) if P.drive_velocity_filter > 0.0 else 0.0
    S.speed_estimate = keep * S.speed_estimate + (1.0 - keep) * (angle - S.last_angle) / period
    S.last_angle = angle
    out[SPEED] = S.speed_estimate * P.machine_ratio
    mode, reference = command[MODE], command[REFERENCE]
    limit = P.drive_command_limit
    if mode < VELOCITY_MODE:
        S.integral = 0.0
        if mode == VOLTAGE_MODE:
            return min(max(reference, -limit), limit)
        if mode == CURRENT_MODE:
            return min(max(reference / P.drive_gain, -limit), limit)
        return 0.0
    if mode == IMPEDANCE_MODE:
        S.integral = 0.0
        torque = (command[KP] * (reference - angle)
                  + command[KD] * (command[SPEED_REFERENCE] - S.speed_estimate)
                  + command[FEED_FORWARD])
        u = torque / (P.machine_torque_constant * P.machine_ratio * P.drive_gain)
        return min(max(u, -limit), limit)
    wanted = reference
    if mode == POSITION_MODE:
        top = P.drive_velocity_limit
        seen = out[LOAD] if P.drive_load_feedback > 0.5 else angle
        wanted = min(max(P.drive_position_gain * (reference - seen), -top), top)
    error = wanted - S.speed_estimate
    gain = P.drive_velocity_gain * (1.0 + P.withheld_controller_gain)
    more = (P.drive_velocity_integral * (1.0 + P.withheld_controller_integral)) * period * error
    u = gain * error + S.integral + more
    if abs(u) <= limit:
        S.integral += more
    return min(max(u, -limit), limit)


@nb.njit
def _answer(P, S, period, h, command, noise, out):
    _latch(P, S, period, h, noise, out)
    u = _loops(P, S, period, command, out)
    S.command = u
    S.external_target = command[EXTERNAL]
    out[VOLTAGE] = u
    out[CURRENT_REFERENCE] = P.drive_gain * u if P.drive_current_loop > 0.5 else nan


def _compiled(sources):
    # `sources` is part of numba's cache key
    @nb.njit(cache=True)
    def answer(parameters, state, period, step, command, noise, out):
        """Latch the sensors into ``out`` and take over ``command`` (mode, reference, external)."""
        sources  # noqa: B018
        h = period / ceil(period / step - 1e-9)
        _answer(parameters[0], state[0], period, h, command, noise, out)

    @nb.njit(cache=True, nogil=True)
    def advance(parameters, state, period, step):
        """Let ``period`` seconds pass in equal substeps of at most ``step``."""
        sources  # noqa: B018
        steps = ceil(period / step - 1e-9)
        _advance(parameters[0], state[0], steps, period / steps)

    @nb.njit(cache=True, nogil=True)
    def record(parameters, state, period, step, commands, noise, out):
        """Answer and advance for each row of ``commands`` (n, 3) and ``noise`` (n, 6)."""
        sources  # noqa: B018
        P, S = parameters[0], state[0]
        steps = ceil(period / step - 1e-9)
        for k in range(len(commands)):
            _answer(P, S, period, period / steps, commands[k], noise[k], out[k])
            _advance(P, S, steps, period / steps)

    return answer, advance, record


def _sources() -> str:
    folder = Path(__file__).parent
    digest = sha256()
    for name in ('substeps', 'slip_elements', 'mesh', 'flexspline', 'coupled_mass',
                 'motor_current', 'rig_state', 'rig_properties', 'rig_sampling'):
        digest.update((folder / f'{name}.py').read_bytes())
    return digest.hexdigest()


answer, advance, record = _compiled(_sources())
