"""
A second rig, which shares no law with the twin or with the emulated rig.

Everything in it is smooth: friction is a steep hyperbolic tangent, play a soft dead zone, memory a
Bouc-Wen law; it is integrated by Runge-Kutta of fourth order. It knows neither package.
"""

from __future__ import annotations

from math import atan2, cos, exp, pi, sin, sqrt, tanh
from typing import NamedTuple

from numba import njit
import numpy as np

STATES = 11
(MOTOR, MOTOR_SPEED, LOAD, LOAD_SPEED, CURRENT, CURRENT_RATE, BRISTLE, LOOP, HUNG, HUNG_SPEED,
 SLACK) = range(STATES)


class Machine(NamedTuple):
    """What the rig is and does; SI units, each torque at its own shaft; a property at 0 is off."""

    # the machine
    ratio: float
    rotor_inertia: float
    load_inertia: float
    stiffness: float
    damping: float
    torque_constant: float
    gain: float               # A/V, or V/V of a machine with a resistance
    motor_coulomb: float
    motor_viscous: float
    load_coulomb: float
    load_viscous: float
    kp: float                 # V s/rad
    ki: float                 # V/rad
    position_gain: float      # 1/s; 0: the speed is controlled
    filter: float             # s
    limit: float              # V
    creep: float              # rad/s of the load below which friction fades
    period: float             # s
    motor_count: float        # rad
    load_count: float         # rad
    torque_noise: float       # N m
    current_noise: float      # A
    resistance: float = 0.0
    inductance: float = 0.0
    back_emf: float = 0.0
    play: float = 0.0         # rad
    # the drive
    lag: float = 7e-5         # s, of second order
    delay: float = 0.0        # s
    dead: float = 0.0         # V
    ceiling: float = 0.0      # A, or V of a machine with a resistance
    supply: float = 0.0       # ohm by which the supply sags
    sinking: float = 0.0      # 1/A, of the torque constant
    ripple: float = 0.0
    cogging: float = 0.0      # N m
    poles: float = 12.0       # of ripple and cogging, a motor turn
    # friction of the load
    sticking: float = 0.0     # N m
    fade: float = 0.05        # rad/s
    bristle: float = 0.0      # rad
    one_way: float = 0.0      # N m
    by_load: float = 0.0
    by_angle: float = 0.0     # N m
    lobes: float = 1.0
    drag: float = 0.0         # N m at 1 rad/s, power 2.1
    run_in: float = 0.0       # share
    run_in_time: float = 4.0  # s
    thin: float = 0.0         # s/rad, of the viscous part
    # what else acts on the load
    weight: float = 0.0       # N m
    weight_angle: float = 0.0
    spring: float = 0.0       # N m/rad
    hung: float = 0.0         # kg m2
    hung_frequency: float = 10.0
    cushion: float = 0.0      # N m/rad beyond
    cushion_angle: float = 1.0
    # the mesh
    soft: float = 0.0         # share of the stiffness
    reach: float = 1e-4       # rad
    loop: float = 0.0         # N m
    play_load: float = 0.0    # rad
    tooth: float = 0.0        # rad
    teeth: float = 20.0
    # the sensors
    eccentric: float = 0.0
    late: float = 0.0         # s, the load encoder
    torque_gain: float = 1.0
    torque_zero: float = 0.0
    current_gain: float = 1.0
    current_zero: float = 0.0
    slip: float = 0.0         # rad/(N m s), of the load encoder's coupling
    # what the loop is told, times that of the data sheet
    proportional: float = 1.0
    integral: float = 1.0


@njit(cache=True)
def _softplus(x):
    return x if x > 30.0 else np.log1p(exp(x))


@njit(cache=True)
def _beyond(x, width):
    """Return what is left of x beyond a soft dead zone, and its slope."""
    if width <= 0.0:
        return x, 1.0
    blunt = 0.005 * width
    up, down = (x - 0.5 * width) / blunt, (-x - 0.5 * width) / blunt
    left = blunt * (_softplus(up) - _softplus(down))
    return left, 1.0 / (1.0 + exp(min(-up, 500.0))) + 1.0 / (1.0 + exp(min(-down, 500.0)))


@njit(cache=True)
def _bouc_wen(z, moved, travel):
    turning = 1.0 if z * moved > 0.0 else 0.0
    return moved / travel * (1.0 - turning * abs(z))


@njit(cache=True)
def _mesh(m, x):
    """Return the torque on the load, N m, and how fast teeth that touch wind up, rad/s."""
    angle = m.teeth * x[LOAD]
    lost = m.tooth * (sin(angle) + 0.3 * sin(2.0 * angle + 1.0))
    losing = m.tooth * m.teeth * (cos(angle) + 0.6 * cos(2.0 * angle + 1.0)) * x[LOAD_SPEED]
    wound = x[MOTOR] / m.ratio - x[LOAD] - lost
    rate = x[MOTOR_SPEED] / m.ratio - x[LOAD_SPEED] - losing
    width = m.play
    if m.play_load > 0.0:
        pressed = max(abs(wound) - 0.5 * m.play, 0.0)
        width += m.play_load * pressed**2 / (pressed**2 + m.reach**2)
    wound, contact = _beyond(wound, width)
    torque = m.stiffness * (wound - m.soft * m.reach * tanh(wound / m.reach))
    rate *= contact
    return torque + m.damping * rate + m.loop * x[LOOP] * contact, rate


@njit(cache=True)
def _change(m, t, x, volts, external, d):
    """Write the time derivative of the state into ``d``."""
    torque, rate = _mesh(m, x)
    w, v = x[MOTOR_SPEED], x[LOAD_SPEED]
    command = volts if m.dead <= 0.0 else _beyond(volts, 2.0 * m.dead)[0]
    if m.resistance > 0.0:
        terminal = m.gain * command
        if m.supply > 0.0:
            terminal /= 1.0 + m.supply * abs(x[CURRENT]) / m.limit
        if m.ceiling > 0.0:
            terminal = m.ceiling * tanh(terminal / m.ceiling)
        d[CURRENT] = (terminal - m.resistance * x[CURRENT] - m.back_emf * w) / m.inductance
        d[CURRENT_RATE] = 0.0
    else:
        wanted = m.gain * command
        if m.ceiling > 0.0:
            wanted = wanted / (1.0 + (wanted / m.ceiling)**8)**0.125
        d[CURRENT] = x[CURRENT_RATE]
        bend = 2.0 / m.lag
        d[CURRENT_RATE] = bend * bend * (wanted - x[CURRENT]) - 2.0 * bend * x[CURRENT_RATE]
    shaft = m.torque_constant * x[CURRENT] / sqrt(1.0 + (m.sinking * x[CURRENT])**2)
    phase = m.poles * x[MOTOR]
    shaft *= 1.0 + m.ripple * (sin(phase) + 0.2 * cos(2.0 * phase))
    shaft += m.cogging * tanh(2.0 * sin(phase + 0.7))
    shaft -= m.motor_coulomb * tanh(w / (m.creep * m.ratio)) + m.motor_viscous * w

    level = m.load_coulomb + m.sticking / (1.0 + (v / m.fade)**2)
    level *= 1.0 + m.run_in * m.run_in_time / (m.run_in_time + t)
    level += m.by_load * sqrt(torque**2 + 1e-4 * m.load_coulomb**2)
    level += m.by_angle * exp(2.0 * (cos(m.lobes * x[LOAD]) - 1.0))
    way = tanh(v / m.creep)
    d[BRISTLE] = 0.0
    if m.bristle > 0.0:
        d[BRISTLE] = _bouc_wen(x[BRISTLE], v, m.bristle)
        way = x[BRISTLE]
    resists = level * way + m.load_viscous * v / (1.0 + m.thin * abs(v))
    resists += m.one_way * max(0.0, tanh(v / m.creep))
    resists += m.drag * abs(v)**1.1 * v
    resists += m.weight * sin(x[LOAD] + m.weight_angle) + m.spring * x[LOAD]
    if m.cushion > 0.0:
        resists += m.cushion * max(0.0, x[LOAD] - m.cushion_angle)
    d[HUNG], d[HUNG_SPEED] = v, 0.0
    if m.hung > 0.0:
        natural = 2.0 * pi * m.hung_frequency
        pull = m.hung * (natural**2 * (x[LOAD] - x[HUNG])
                         + 0.06 * natural * (v - x[HUNG_SPEED]))
        resists += pull
        d[HUNG], d[HUNG_SPEED] = x[HUNG_SPEED], pull / m.hung
    d[LOOP] = _bouc_wen(x[LOOP], rate, m.reach) if m.loop > 0.0 else 0.0
    d[SLACK] = m.slip * abs(torque) * torque / (1e-9 + abs(torque))
    d[MOTOR], d[MOTOR_SPEED] = w, (shaft - torque / m.ratio) / m.rotor_inertia
    d[LOAD], d[LOAD_SPEED] = v, (torque - resists - external) / m.load_inertia


@njit(cache=True)
def _move(m, t, x, volts, external, h, work):
    """Advance the state by a step of Runge-Kutta."""
    a, b, c, e, y = work
    _change(m, t, x, volts, external, a)
    y[:] = x + 0.5 * h * a
    _change(m, t + 0.5 * h, y, volts, external, b)
    y[:] = x + 0.5 * h * b
    _change(m, t + 0.5 * h, y, volts, external, c)
    y[:] = x + h * c
    _change(m, t + h, y, volts, external, e)
    x += h / 6.0 * (a + 2.0 * b + 2.0 * c + e)


@njit(cache=True)
def _run(m, position, speed, external, start, jitter, step):
    """Return motor angle, load angle, torque, current and command of each sample."""
    x = np.zeros(STATES)
    x[LOAD], x[MOTOR], x[HUNG] = start, start * m.ratio, start
    work = np.zeros((5, STATES))
    out = np.zeros((len(speed), 5))
    integral, filtered, before, sent, late = 0.0, 0.0, 0.0, 0.0, start
    steps = int(np.ceil(m.period / step))
    h = m.period / steps
    keep = exp(-m.period / m.filter) if m.filter > 0.0 else 0.0
    for k in range(len(speed)):
        reading = m.motor_count * np.round((x[MOTOR] + m.motor_count * jitter[k, 0])
                                           / m.motor_count)
        turned = x[LOAD] + atan2(m.eccentric * sin(x[LOAD] + 0.4),
                                 1.0 + m.eccentric * cos(x[LOAD] + 0.4)) + x[SLACK]
        then = turned - m.late * (turned - late) / m.period
        late = turned
        out[k, 0] = reading
        out[k, 1] = m.load_count * np.round((then + m.load_count * jitter[k, 1]) / m.load_count)
        out[k, 2] = (m.torque_gain * _mesh(m, x)[0] + m.torque_zero
                     + m.torque_noise * jitter[k, 2])
        out[k, 3] = m.current_gain * x[CURRENT] + m.current_zero + m.current_noise * jitter[k, 3]
        if k == 0:
            before = reading
        filtered = keep * filtered + (1.0 - keep) * (reading - before) / (m.period * m.ratio)
        before = reading
        wanted = speed[k]
        if m.position_gain > 0.0:
            wanted += m.position_gain * (position[k] - reading / m.ratio)
        error = wanted - filtered
        more = m.integral * m.ki * m.period * error
        volts = m.proportional * m.kp * error + integral + more
        if abs(volts) <= m.limit:
            integral += more
        volts = min(max(volts, -m.limit), m.limit)
        out[k, 4] = volts
        for i in range(steps):
            _move(m, k * m.period + i * h, x, sent if i * h < m.delay else volts, external[k], h,
                  work)
        sent = volts
    return out


def record(machine: Machine, position: np.ndarray, speed: np.ndarray, external: np.ndarray,
           seed: int) -> dict[str, np.ndarray]:
    """
    Run the rig from rest at the first position and return its columns by name.

    ``position`` (rad), ``speed`` (rad/s) and ``external`` (N m, resists) of shape (samples,) are
    what the loop is asked for and the brake does. Raises RuntimeError where it diverges.
    """
    jitter = np.random.default_rng(seed).standard_normal((len(speed), 4)) * [0.3, 0.3, 1.0, 1.0]
    level = machine.load_coulomb + machine.sticking + machine.one_way + machine.by_angle
    fastest = max(level / (machine.load_inertia * machine.creep),
                  machine.motor_coulomb / (machine.rotor_inertia * machine.creep * machine.ratio),
                  2.0 / machine.lag if not machine.resistance else 0.0, 4e4)
    out = _run(machine, position, speed, external, float(position[0]), jitter, 2.0 / fastest)
    if not np.all(np.isfinite(out)):
        raise RuntimeError(f'the second rig diverges: {machine}')
    names = ('motor_position', 'load_position', 'torque', 'current', 'voltage')
    return {**dict(zip(names, out.T, strict=True)), 'external_torque': external,
            'reference_velocity': speed,
            'reference_position': np.where(machine.position_gain > 0.0, position, np.nan)}
