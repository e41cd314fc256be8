"""
What happens at a SYNC of the feed drive, and between two: the compiled entry points.

The control closes its position loop at each SYNC on the motor's encoder, which it is told a little
late, and gives the drive a speed, in V. As of ..sampling: same columns, same names.
"""

from __future__ import annotations

from hashlib import sha256
from math import ceil, nan, pi, sin
from pathlib import Path

import numba as nb

from ..rig_sampling import (
    CURRENT,
    CURRENT_MODE,
    CURRENT_REFERENCE,
    EXTERNAL,
    EXTERNAL_NOW,
    LOAD,
    MODE,
    MOTOR,
    OFF,
    POSITION_MODE,
    REFERENCE,
    SPEED,
    TEMPERATURE,
    TORQUE,
    VELOCITY_MODE,
    VOLTAGE,
    VOLTAGE_MODE,
)
from . import screw, stator_frame
from .feed_state import fresh_state

__all__ = ['advance', 'answer', 'fresh_state', 'record']

_drive, _encoder = stator_frame.drive, stator_frame.encoder
_advance_current = stator_frame.advance_current
_mechanics, _surroundings = screw.mechanics, screw.surroundings
LINE = 20e-6  # m, of the scale


@nb.njit
def _latch(P, S, noise, out):
    quiet = P.sensors_noise
    out[MOTOR] = _encoder(P, S.motor_angle)
    out[SPEED] = S.speed_estimate
    if P.sensors_load_encoder > 0.0:
        place = S.table + quiet * P.sensors_load_noise * noise[1]
        place += P.sensors_load_cyclic * sin(2.0 * pi / LINE * S.table)
        step = P.sensors_load_step * P.sensors_counts
        out[LOAD] = place if step == 0.0 else step * (place // step + 0.5)
    else:
        out[LOAD] = nan
    out[TORQUE] = nan
    out[CURRENT] = S.current + quiet * P.sensors_current_noise * noise[4]
    out[TEMPERATURE] = S.temperature + quiet * P.sensors_temperature_noise * noise[5]
    out[EXTERNAL_NOW] = S.external


@nb.njit
def _answer(P, S, command, noise, out):
    _latch(P, S, noise, out)
    S.mode, reference = command[MODE], command[REFERENCE]
    S.external_target = command[EXTERNAL]
    u, limit = 0.0, P.drive_command_limit
    if S.mode == VOLTAGE_MODE:
        u = reference
    elif S.mode == VELOCITY_MODE:
        u = reference * P.machine_ratio / P.drive_command_gain
    elif S.mode == POSITION_MODE:
        late = _encoder(P, S.motor_angle - P.drive_latency * S.motor_speed)
        u = P.drive_position_gain * (reference * P.machine_ratio - late) / P.drive_command_gain
    elif S.mode == CURRENT_MODE:
        S.target = reference
    S.command = min(max(u, -limit), limit)
    out[VOLTAGE] = S.command
    out[CURRENT_REFERENCE] = S.wanted if S.mode != OFF else 0.0


@nb.njit
def _advance(P, S, steps, h):
    for _ in range(steps):
        _drive(P, S, h)
        torque = _advance_current(P, S, h)
        heat = _mechanics(P, S, torque, h)
        _surroundings(P, S, heat, h)
        S.time += h


def _compiled(sources):
    # `sources` is part of numba's cache key
    @nb.njit(cache=True)
    def answer(parameters, state, period, step, command, noise, out):
        """Latch the sensors into ``out`` and take over ``command`` (mode, reference, external)."""
        sources  # noqa: B018
        _answer(parameters[0], state[0], command, noise, out)

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
            _answer(P, S, commands[k], noise[k], out[k])
            _advance(P, S, steps, period / steps)

    return answer, advance, record


def _sources() -> str:
    folder, digest = Path(__file__).parent, sha256()
    for file in (*sorted(folder.glob('*.py')), folder.parent / 'slip_elements.py'):
        digest.update(file.read_bytes())
    return digest.hexdigest()


answer, advance, record = _compiled(_sources())
