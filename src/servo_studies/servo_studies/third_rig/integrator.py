r"""
A servo in motion: drive, rotor, gear, load, loop and sensors, by Moreau-Jean time stepping.

The speeds at the end of a step solve one strictly convex problem of two unknowns,

.. math:: \min_{v^+} \tfrac12 v^{+T} A v^+ - r^T v^+ + \sum_i F_i |v_i^+|,
          \quad A = M/h + B + \tfrac12 (\tfrac h2 k + d) W W^T

with the implicit midpoint rule for the gear (its contact found by Newton's method) and Coulomb
friction as a set-valued force. Friction is therefore exact at rest, no event has to be located,
and a frictionless gear keeps its energy. Source: Jean, CMAME 177 (1999); Acary, Brogliato,
Numerical Methods for Nonsmooth Dynamical Systems, Springer 2008, ch. 10.

What a machine does beyond this are **terms**: products of up to three tabulated curves, each of
one variable, that are summed up at a port. A curve is any Python function (see `tables`).

Signs: positive angle, speed and torque point the same way on both shafts; the torque of the gear
is that on the load; friction and the external torque resist.
"""

from __future__ import annotations

from math import asinh, exp, floor, pi, sin, sqrt
from typing import NamedTuple

from numba import njit
import numpy as np

VARIABLES = ('motor_angle', 'load_angle', 'motor_speed', 'load_speed', 'motor_rate', 'load_rate',
             'direction', 'flank', 'torque', 'driven_torque', 'current', 'command', 'time',
             'temperature_rise', 'contact', 'rest')
(MOTOR_ANGLE, LOAD_ANGLE, MOTOR_SPEED, LOAD_SPEED, MOTOR_RATE, LOAD_RATE, DIRECTION, FLANK, TORQUE,
 DRIVEN_TORQUE, CURRENT, COMMAND, TIME, RISE, CONTACT, REST) = range(len(VARIABLES))
PORTS = ('motor_friction', 'load_friction', 'motor_torque', 'load_torque', 'command',
         'gear_torque', 'motor_error', 'load_error', 'gap', 'gap_by_load', 'stiffness',
         'rotor_inertia', 'load_inertia', 'motor_reading', 'load_reading', 'torque_reading',
         'current_reading')
(MOTOR_FRICTION, LOAD_FRICTION, MOTOR_TORQUE, LOAD_TORQUE, COMMAND_ADDED, GEAR_TORQUE, MOTOR_ERROR,
 LOAD_ERROR, GAP, GAP_BY_LOAD, STIFFNESS, ROTOR_ADDED, LOAD_ADDED, MOTOR_READING, LOAD_READING,
 TORQUE_READING, CURRENT_READING) = np.arange(len(PORTS))  # no literals: compiled once for all
# the state: angles and speeds, current, what hangs on motor and load, the gear, and what fades
STATES = 17
(QM, QL, VM, VL, AMPS, IRATE, RINGS, HUNG, HUNG_RATE, PULL, TOUCH, ZERO, OPENED, SLIPPED, WARMTH,
 STOOD, TURNED) = range(STATES)
NODES, ELEMENTS, RING = 1024, 12, 8192
SPEED_PI, POSITION_LOOP, CASCADE = 1, 2, 3
SLIP_ELEMENTS, DAHL, ELASTOPLASTIC, RELAXING = 1, 2, 3, 4
CONSTANT, FIRST_ORDER, MEAN = 1, 2, 3
SECOND_ORDER, SLEW = 2, 3
LINEAR, SWINGING, HARDENING, DRY = 1, 2, 3, 4


class Plant(NamedTuple):
    """What the machine is; SI units, each torque at its own shaft; what is 0 is not there."""

    ratio: float
    rotor_inertia: float
    load_inertia: float
    stiffness: float               # N m/rad, seen from the load
    damping: float                 # N m s/rad
    torque_constant: float
    gain: float                    # A/V, or V/V of a machine with a resistance
    resistance: float = 0.0
    inductance: float = 0.0
    back_emf: float = 0.0
    motor_coulomb: float = 0.0
    motor_viscous: float = 0.0
    load_coulomb: float = 0.0
    load_viscous: float = 0.0
    gap: float = 0.0               # rad of the load, from flank to flank
    controller: float = 0.0
    kp: float = 0.0
    kv: float = 0.0
    ki: float = 0.0
    kd: float = 1.0
    kf: float = 0.0
    filter: float = 0.0            # s
    speed_limit: float = 1e9       # rad/s
    limit: float = 10.0            # V
    lag_kind: float = 0.0          # of the current
    lag: float = 0.0               # s; of SLEW: A/s
    ring_inertia: float = 0.0      # on the rotor behind a film
    ring_time: float = 0.0         # s
    hung_kind: float = 0.0         # what hangs on the load by a spring
    hung_inertia: float = 0.0
    hung_frequency: float = 0.0    # Hz, load held
    hung_damping: float = 0.0      # of critical
    hung_shape: float = 0.0        # 1/rad of SWINGING, 1/rad2 of HARDENING, N m of DRY
    gap_time: float = 0.0          # s, of the gap that a load opens
    crush: float = 0.0             # rad of contact at which the damping is there in full
    oil: float = 0.0               # N m s/rad inside the gap
    clutch: float = 0.0            # N m at which the coupling slips
    clutch_drag: float = 1.0       # N m s/rad of slip
    rest_travel: float = 1e-3      # rad of sliding that ends a rest
    flank_travel: float = 1e-3     # rad of the load after a reversal
    heat: float = 0.0              # K/J
    cooling: float = 60.0          # s
    motor_late_kind: float = 0.0
    motor_late: float = 0.0        # s
    load_late_kind: float = 0.0
    load_late: float = 0.0
    torque_late_kind: float = 0.0
    torque_late: float = 0.0
    motor_count: float = 0.0       # rad
    load_count: float = 0.0
    torque_count: float = 0.0      # N m
    current_count: float = 0.0     # A

    def as_record(self) -> np.record:
        """Return the same for compiled code, which passes a record by its address."""
        return np.array([tuple(self)], dtype=[(name, float) for name in self._fields])[0]


# Terms are one row of numbers: where the terms of each port begin, and the end of the last; six of
# each term, the variables of up to three factors (-1: none) and where their tables begin; and each
# table: where it begins, cells per unit, warp, whether it repeats, and its nodes, over even cells
# of asinh(x / warp) or of x.


@njit(cache=True, error_model='numpy')
def look(laws, table, at):
    """Return the value of a table and its slope."""
    steep, warp = laws[table + 1], laws[table + 2]
    if warp > 0.0:
        steep /= sqrt(at * at + warp * warp)
        at = asinh(at / warp)
    cell = (at - laws[table]) * laws[table + 1]
    if laws[table + 3] > 0.0:
        cell -= NODES * floor(cell / NODES)
    else:
        cell = min(max(cell, 0.0), NODES - 1e-9)
    i = min(int(cell), NODES - 1)
    left, right = laws[table + 4 + i], laws[table + 5 + i]
    return left + (cell - i) * (right - left), (right - left) * steep


@njit(cache=True, error_model='numpy')
def total(laws, port, x):
    """Return the sum of the terms of a port, and its slope by their first variables."""
    value, slope = 0.0, 0.0
    if laws[port] == laws[port + 1]:
        return value, slope
    for n in range(int(laws[port]), int(laws[port + 1]), 6):
        product, rise = look(laws, int(laws[n + 3]), x[int(laws[n])])
        for j in range(1, 3):
            if laws[n + j] >= 0.0:
                factor = look(laws, int(laws[n + 3 + j]), x[int(laws[n + j])])[0]
                product *= factor
                rise *= factor
        value += product
        slope += rise
    return value, slope


# Elements with memory at the friction of motor (0) and load (1) and in the gear (2) are a row
# each: kind, height (N m, of the gear alone), power, then the reach (rad), weight and lapse (s; 0:
# never) of each element.
REACH, WEIGHT, LAPSE = 3, 3 + ELEMENTS, 3 + 2 * ELEMENTS


@njit(cache=True, error_model='numpy')
def held(memory, z):
    """Return what elements with memory hold, as a share of their height."""
    if memory[0] == SLIP_ELEMENTS or memory[0] == RELAXING:
        share = 0.0
        for i in range(ELEMENTS):
            share += memory[WEIGHT + i] * z[i]
        return share
    return z[0]


@njit(cache=True, error_model='numpy')
def tangent(memory, z, way):
    """Return how fast that share rises for a motion one way, 1/rad."""
    kind, power = memory[0], memory[2]
    if kind == SLIP_ELEMENTS or kind == RELAXING:
        rise = 0.0
        for i in range(ELEMENTS):
            if memory[WEIGHT + i] > 0.0 and (kind == RELAXING or z[i] * way < 1.0):
                rise += memory[WEIGHT + i] / memory[REACH + i]
        return rise
    along = z[0] * way
    if kind == DAHL:
        return max(1.0 - along, 0.0)**power / memory[REACH]
    slips = 0.0
    if along > power:
        slips = 0.5 + 0.5 * sin(pi * (min(along, 1.0) - 0.5 * (1.0 + power)) / (1.0 - power))
    return max(1.0 - slips * along, 0.0) / memory[REACH]


@njit(cache=True, error_model='numpy')
def stretch(memory, z, moved, h):
    """Let elements with memory follow a motion, rad, in a time, s."""
    kind = memory[0]
    if kind == SLIP_ELEMENTS or kind == RELAXING:
        for i in range(ELEMENTS):
            if memory[WEIGHT + i] > 0.0:
                z[i] += moved / memory[REACH + i]
                if kind == SLIP_ELEMENTS:
                    z[i] = min(max(z[i], -1.0), 1.0)
                elif memory[LAPSE + i] > 0.0:
                    z[i] *= exp(-h / memory[LAPSE + i])
    elif moved != 0.0:
        way = 1.0 if moved > 0.0 else -1.0
        z[0] = min(max(z[0] + moved * tangent(memory, z, way), -1.0), 1.0)


@njit(cache=True, error_model='numpy')
def _gear(p, laws, memory, z, x, stiffness, gap, before, wind, rate):
    """Return torque of the gear (N m), its stiffness and damping now, and the contact (rad)."""
    half = 0.5 * gap
    contact = wind - min(max(wind, -half), half)
    if half > 0.0 and contact == 0.0:
        return p.oil * rate, 0.0, p.oil, 0.0
    x[CONTACT] = contact
    more, steeper = total(laws, GEAR_TORQUE, x)
    torque, steep = stiffness * contact + more, stiffness + steeper
    if memory[0] > 0.0:
        rise = memory[1] * tangent(memory, z, 1.0 if contact > before else -1.0)
        torque += memory[1] * held(memory, z) + rise * (contact - before)
        steep += rise
    damping = p.damping
    if p.crush > 0.0:
        damping *= min(1.0, abs(contact) / p.crush)
    return torque + damping * rate, max(steep, 0.0), damping, contact


@njit(cache=True, error_model='numpy')
def solve(a, b, c, r, s, up_1, down_1, up_2, down_2, way_1, way_2):
    """
    Return the speeds that minimise the step's convex problem with matrix [[a, b], [b, c]].

    ``up`` and ``down`` are what each shaft resists with forward and in reverse; the signs of the
    speeds are tried as they were (``way``) before all others.
    """
    guess_1, guess_2 = 0.0, 0.0
    for n in range(-1, 9):
        i, j = (way_1, way_2) if n < 0 else (n // 3 - 1, n % 3 - 1)
        r_1 = r - (up_1 if i > 0 else -down_1 if i < 0 else 0.0)
        s_2 = s - (up_2 if j > 0 else -down_2 if j < 0 else 0.0)
        if i != 0 and j != 0:
            whole = a * c - b * b
            v, w = (c * r_1 - b * s_2) / whole, (a * s_2 - b * r_1) / whole
        else:
            v, w = (r_1 / a if i != 0 else 0.0), (s_2 / c if j != 0 else 0.0)
        left_1, left_2 = r - b * w, s - b * v
        if n <= 0 or abs(v) + abs(w) > abs(guess_1) + abs(guess_2):
            guess_1, guess_2 = v, w
        if ((v * i > 0.0 if i != 0 else -down_1 <= left_1 <= up_1)
                and (w * j > 0.0 if j != 0 else -down_2 <= left_2 <= up_2)):
            return v, w
    return guess_1, guess_2


@njit(cache=True, error_model='numpy')
def _command(p, s, position, velocity, motor, load, period):
    """
    Return the command, V, of the loop that the servo file names; ``s`` is its memory.

    All of them: a speed from differences of the encoder behind a low pass, and an integral that
    stands still while the command is at its limit.
    """
    angle = motor / p.ratio
    if s[0] == 0.0:
        s[0], s[1] = 1.0, angle
    keep = exp(-period / p.filter) if p.filter > 0.0 else 0.0
    s[2] = keep * s[2] + (1.0 - keep) * (angle - s[1]) / period
    s[1] = angle
    if p.controller == SPEED_PI:
        error = velocity - s[2]
    elif p.controller == POSITION_LOOP:
        error = p.kp * (position - angle) + p.kf * velocity - p.kd * s[2]
    else:
        error = min(max(p.kp * (position - load), -p.speed_limit), p.speed_limit) - s[2]
    more = p.ki * period * error
    command = p.kv * error + s[3] + more
    if abs(command) <= p.limit:
        s[3] += more
    return min(max(command, -p.limit), p.limit)


@njit(cache=True, error_model='numpy')
def _late(kind, late, past, steps, h, now):
    """
    Return a reading as old as its sensor makes it.

    ``past`` (3, RING) holds what was read, its integral and its first-order lag at each step.
    """
    if kind == 0.0 or late <= 0.0 or steps < 2:
        return now
    if kind == FIRST_ORDER:
        return past[2, steps % RING]
    back = min(late / h, min(steps, RING) - 1.001)
    whole = int(back)
    newer, older = past[0, (steps - whole) % RING], past[0, (steps - whole - 1) % RING]
    part = back - whole
    if kind == CONSTANT:
        return newer + part * (older - newer)
    area = past[1, steps % RING] - past[1, (steps - whole) % RING]
    return (area / h + part * (newer + 0.5 * part * (older - newer))) / back


@njit(cache=True, error_model='numpy')
def _remember(kind, late, past, steps, h, now):
    """Add a reading to the past of a sensor."""
    i, j = steps % RING, (steps - 1) % RING
    before = past[0, j]
    past[0, i], past[1, i] = now, past[1, j] + 0.5 * h * (now + before)
    if kind == FIRST_ORDER:
        gone = 1.0 - exp(-h / late)
        past[2, i] = past[2, j] + gone * (before - past[2, j]) + (now - before) * (
            1.0 - gone * late / h)


@njit(cache=True, error_model='numpy')
def _counted(reading, count):
    return count * floor(reading / count + 0.5) if count > 0.0 else reading


@njit(cache=True, error_model='numpy')
def _drive(p, laws, x, s, command, h):
    """Advance the current, A, under a command, V."""
    wanted = p.gain * (command + total(laws, COMMAND_ADDED, x)[0])
    if p.resistance > 0.0:
        half = 0.5 * p.resistance
        s[AMPS] = ((p.inductance / h - half) * s[AMPS] + wanted - p.back_emf * s[VM]) / (
            p.inductance / h + half)
    elif p.lag_kind == FIRST_ORDER:
        s[AMPS] += (wanted - s[AMPS]) * (1.0 - exp(-h / p.lag))
    elif p.lag_kind == SECOND_ORDER:
        part = h / p.lag
        s[IRATE] += part / p.lag * (wanted - s[AMPS])
        s[IRATE] /= 1.0 + 0.9 * part + part * part
        s[AMPS] += h * s[IRATE]
    elif p.lag_kind == SLEW:
        s[AMPS] += min(max(wanted - s[AMPS], -h * p.lag), h * p.lag)
    else:
        s[AMPS] = wanted
    x[CURRENT] = s[AMPS]


@njit(cache=True, error_model='numpy')
def _hung(p, s, h):
    """Advance what hangs on the load and return its pull, N m."""
    bent, rate = s[HUNG] - s[QL], s[HUNG_RATE] - s[VL]
    spring = p.hung_inertia * (2.0 * pi * p.hung_frequency)**2
    pull = spring * bent
    if p.hung_kind == SWINGING:
        pull = spring * sin(p.hung_shape * bent) / p.hung_shape
    elif p.hung_kind == HARDENING:
        pull += spring * p.hung_shape * bent**3
    elif p.hung_kind == DRY:
        pull += p.hung_shape * rate / (abs(rate) + 2e-3)
    pull += 2.0 * p.hung_damping * sqrt(spring * p.hung_inertia) * rate
    s[HUNG_RATE] -= h / p.hung_inertia * pull
    s[HUNG] += h * s[HUNG_RATE]
    return pull


@njit(cache=True, error_model='numpy')
def _directional(laws):
    """Return whether a friction depends on the direction of its motion."""
    for n in range(int(laws[0]), int(laws[LOAD_FRICTION + 1]), 6):
        for j in range(n, n + 3):
            if laws[j] == DIRECTION or laws[j] == DRIVEN_TORQUE:
                return True
    return False


@njit(cache=True, error_model='numpy')
def _levels(p, laws, x, torque, way):
    """Return what motor and load resist with in one direction, N m."""
    x[DIRECTION], x[DRIVEN_TORQUE] = way, torque * way
    return (max(0.0, p.motor_coulomb + total(laws, MOTOR_FRICTION, x)[0]),
            max(0.0, p.load_coulomb + total(laws, LOAD_FRICTION, x)[0]))


@njit(cache=True, error_model='numpy')
def _errors(laws, x, motor, load):
    """Return the angle that the gear loses, rad, and its slopes by both angles."""
    x[MOTOR_ANGLE], x[LOAD_ANGLE] = motor, load
    by_motor, slope_m = total(laws, MOTOR_ERROR, x)
    by_load, slope_l = total(laws, LOAD_ERROR, x)
    return by_motor + by_load, slope_m, slope_l


@njit(cache=True, error_model='numpy')
def _sign(speed):
    return 1 if speed > 0.0 else (-1 if speed < 0.0 else 0)


@njit(cache=True, error_model='numpy')
def _step(p, laws, memory, z, x, s, command, external, time, directional, h):
    """Advance the state over one step; ``x`` are the variables of the terms."""
    vm, vl, torque = s[VM], s[VL], s[PULL]
    x[MOTOR_ANGLE], x[LOAD_ANGLE] = s[QM] + 0.5 * h * vm, s[QL] + 0.5 * h * vl
    x[MOTOR_SPEED], x[LOAD_SPEED], x[MOTOR_RATE], x[LOAD_RATE] = abs(vm), abs(vl), vm, vl
    x[TORQUE], x[CURRENT], x[COMMAND], x[TIME] = torque, s[AMPS], command, time
    x[RISE], x[REST], x[FLANK] = s[WARMTH], s[STOOD], s[TURNED]
    _drive(p, laws, x, s, command, h)

    # what pushes, and on what inertia
    more_m, swell_m = total(laws, ROTOR_ADDED, x)
    more_l, swell_l = total(laws, LOAD_ADDED, x)
    inertia_m, inertia_l = (p.rotor_inertia + more_m) / h, (p.load_inertia + more_l) / h
    push_m = p.torque_constant * s[AMPS] + total(laws, MOTOR_TORQUE, x)[0]
    push_m -= 0.5 * swell_m * vm * vm
    push_l = total(laws, LOAD_TORQUE, x)[0] - external - 0.5 * swell_l * vl * vl
    if p.ring_inertia > 0.0:
        drag = p.ring_inertia * (vm - s[RINGS]) / (p.ring_time + h)
        s[RINGS] += h / p.ring_inertia * drag
        push_m -= drag
    if p.hung_kind > 0.0:
        push_l += _hung(p, s, h)

    # what resists: a level at once, or elements that stretch first
    up_m, up_l = _levels(p, laws, x, torque, 1.0)
    down_m, down_l = _levels(p, laws, x, torque, -1.0) if directional else (up_m, up_l)
    soft_m, soft_l = p.motor_viscous, p.load_viscous
    if memory[0, 0] > 0.0:
        level = up_m if vm >= 0.0 else down_m
        push_m -= level * held(memory[0], z[0])
        soft_m += h * level * tangent(memory[0], z[0], 1.0 if vm >= 0.0 else -1.0)
        up_m = down_m = 0.0
    if memory[1, 0] > 0.0:
        level = up_l if vl >= 0.0 else down_l
        push_l -= level * held(memory[1], z[1])
        soft_l += h * level * tangent(memory[1], z[1], 1.0 if vl >= 0.0 else -1.0)
        up_l = down_l = 0.0

    # the speeds at the end, with the torque of the gear in the middle of the step by Newton
    gap = max(0.0, p.gap + total(laws, GAP, x)[0] + s[OPENED])
    stiffness = p.stiffness * (1.0 + total(laws, STIFFNESS, x)[0])
    _, slope_m, slope_l = _errors(laws, x, x[MOTOR_ANGLE], x[LOAD_ANGLE])
    wind = s[QM] / p.ratio - s[QL] - s[SLIPPED] + s[ZERO] - _errors(laws, x, s[QM], s[QL])[0]
    to_m, to_l = 1.0 / p.ratio - slope_m, 1.0 + slope_l
    was = to_m * vm - to_l * vl
    new_m, new_l, rate = vm, vl, was
    pull, steep, damping, _ = _gear(p, laws, memory[2], z[2], x, stiffness, gap, s[TOUCH],
                                    wind + 0.5 * h * rate, rate)
    for _ in range(8):
        g = 0.5 * h * steep + damping
        base = pull - g * rate
        new_m, new_l = solve(inertia_m + soft_m + 0.5 * g * to_m**2, -0.5 * g * to_m * to_l,
                             inertia_l + soft_l + 0.5 * g * to_l**2,
                             inertia_m * vm + push_m - to_m * (base + 0.5 * g * was),
                             inertia_l * vl + push_l + to_l * (base + 0.5 * g * was),
                             up_m, down_m, up_l, down_l, _sign(vm), _sign(vl))
        rate = 0.5 * (was + to_m * new_m - to_l * new_l)
        expected = base + g * rate
        pull, steep, damping, _ = _gear(p, laws, memory[2], z[2], x, stiffness, gap, s[TOUCH],
                                        wind + 0.5 * h * rate, rate)
        if abs(pull - expected) <= 1e-9 * (abs(pull) + abs(push_l)) + 1e-14:
            break

    # where that leads
    lost = abs(push_m - pull * to_m - inertia_m * (new_m - vm)) * abs(new_m)
    lost += abs(push_l + pull * to_l - inertia_l * (new_l - vl)) * abs(new_l)
    s[WARMTH] += h * (p.heat * (lost + p.resistance * s[AMPS]**2) - s[WARMTH] / p.cooling)
    moved_m, moved_l = 0.5 * h * (vm + new_m), 0.5 * h * (vl + new_l)
    s[QM], s[QL], s[VM], s[VL] = s[QM] + moved_m, s[QL] + moved_l, new_m, new_l
    if memory[0, 0] > 0.0:
        stretch(memory[0], z[0], moved_m, h)
    if memory[1, 0] > 0.0:
        stretch(memory[1], z[1], moved_l, h)
    if p.clutch > 0.0 and abs(pull) > p.clutch:
        s[SLIPPED] += h / p.clutch_drag * (pull - (p.clutch if pull > 0.0 else -p.clutch))
    if p.gap_time > 0.0:
        s[OPENED] += (total(laws, GAP_BY_LOAD, x)[0] - s[OPENED]) * (1.0 - exp(-h / p.gap_time))
    fading = abs(new_l) * h / p.rest_travel
    s[STOOD] = s[STOOD] * exp(-fading) + (
        h if fading < 1e-9 else h * (1.0 - exp(-fading)) / fading)
    if moved_l != 0.0:
        s[TURNED] += (_sign(moved_l) - s[TURNED]) * (1.0 - exp(-abs(moved_l) / p.flank_travel))
    wind = s[QM] / p.ratio - s[QL] - s[SLIPPED] + s[ZERO] - _errors(laws, x, s[QM], s[QL])[0]
    s[PULL], _, _, touch = _gear(p, laws, memory[2], z[2], x, stiffness, gap, s[TOUCH], wind,
                                 to_m * new_m - to_l * new_l)
    if memory[2, 0] > 0.0:
        stretch(memory[2], z[2], touch - s[TOUCH], h)
    s[TOUCH] = touch


@njit(cache=True, error_model='numpy')
def run(p, laws, memory, inputs, arrival, jitter, noise, start, begin, period, substeps):
    """
    Return motor angle, load angle, torque, current, command and temperature rise of each sample.

    ``inputs`` (samples, 4): reference position (rad) and speed (rad/s), external torque (N m), and
    a command (V), NaN where the loop is closed; ``arrival``: delay of each command, s; ``jitter``:
    of the instants, s; ``noise`` (samples, 4): of the readings; ``begin``: time of the first
    sample, s. Row k stands at the instant of sample k, before its command acts; a run that ends in
    infinity is NaN from there on.
    """
    samples, h = len(inputs), period / substeps
    out, commands, loop = np.zeros((samples, 6)), np.zeros(samples), np.zeros(4)
    x, s = np.zeros(len(VARIABLES)), np.zeros(STATES)
    z, past = np.zeros((3, ELEMENTS)), np.zeros((3, 3, RING))
    s[QM], s[QL], s[HUNG] = start * p.ratio, start, start
    s[ZERO] = _errors(laws, x, s[QM], s[QL])[0]
    past[0, 0, 0] = past[0, 2, 0] = s[QM]
    past[1, 0, 0] = past[1, 2, 0] = s[QL]
    directional = _directional(laws)
    arrived, steps = -1, 0
    for k in range(samples):
        # what the sensors read
        x[MOTOR_ANGLE], x[LOAD_ANGLE], x[TORQUE], x[CURRENT] = s[QM], s[QL], s[PULL], s[AMPS]
        x[TIME], x[RISE] = begin + k * period, s[WARMTH]
        motor = _late(p.motor_late_kind, p.motor_late, past[0], steps, h, s[QM])
        load = _late(p.load_late_kind, p.load_late, past[1], steps, h, s[QL])
        torque = _late(p.torque_late_kind, p.torque_late, past[2], steps, h, s[PULL])
        motor += s[VM] * jitter[k] + total(laws, MOTOR_READING, x)[0]
        load += s[VL] * jitter[k] + total(laws, LOAD_READING, x)[0]
        torque += total(laws, TORQUE_READING, x)[0]
        current = s[AMPS] + total(laws, CURRENT_READING, x)[0]
        out[k, 0] = _counted(motor + noise[k, 0], p.motor_count)
        out[k, 1] = _counted(load + noise[k, 1], p.load_count)
        out[k, 2] = _counted(torque + noise[k, 2], p.torque_count)
        out[k, 3] = _counted(current + noise[k, 3], p.current_count)
        out[k, 5] = s[WARMTH]

        # the loop
        commands[k] = inputs[k, 3]
        if commands[k] != commands[k]:
            commands[k] = _command(p, loop, inputs[k, 0], inputs[k, 1], out[k, 0], out[k, 1],
                                   period)
        out[k, 4] = commands[k]

        # up to the next sample
        for i in range(substeps):
            since = k * period + i * h
            while arrived < k and (arrived + 1) * period + arrival[arrived + 1] <= since + 1e-9:
                arrived += 1
            _step(p, laws, memory, z, x, s, commands[arrived] if arrived >= 0 else 0.0,
                  inputs[k, 2], begin + since, directional, h)
            steps += 1
            if p.motor_late_kind > 0.0:
                _remember(p.motor_late_kind, p.motor_late, past[0], steps, h, s[QM])
            if p.load_late_kind > 0.0:
                _remember(p.load_late_kind, p.load_late, past[1], steps, h, s[QL])
            if p.torque_late_kind > 0.0:
                _remember(p.torque_late_kind, p.torque_late, past[2], steps, h, s[PULL])
        if not abs(s[QM]) < 1e12:
            out[k:] = np.nan
            break
    return out
