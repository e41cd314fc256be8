r"""
One step of a servo in motion: drive, rotor, gear and load, by Moreau-Jean time stepping.

The speeds at the end of a step solve one strictly convex problem of two unknowns,

.. math:: \min_{v^+} \tfrac12 v^{+T} A v^+ - r^T v^+ + \sum_i F_i |v_i^+|,
          \quad A = M/h + B + \tfrac12 (\tfrac h2 k + d) W W^T

with the implicit midpoint rule for the gear (its contact found by Newton's method) and Coulomb
friction as a set-valued force. Friction is therefore exact at rest, no event has to be located,
and a frictionless gear keeps its energy. Source: Jean, CMAME 177 (1999); Acary, Brogliato,
Numerical Methods for Nonsmooth Dynamical Systems, Springer 2008, ch. 10.

What a machine does beyond this are its terms and elements with memory (`terms.py`).

Signs: positive angle, speed and torque point the same way on both shafts; the torque of the gear
is that on the load; friction and the external torque resist.
"""

from __future__ import annotations

from math import exp, pi, sin, sqrt

from numba import njit

from .convex_step import solve
from .plant import DRY, FIRST_ORDER, HARDENING, SECOND_ORDER, SLEW, SWINGING
from .terms import (
    COMMAND,
    COMMAND_ADDED,
    CONTACT,
    CURRENT,
    DIRECTION,
    DRIVEN_TORQUE,
    FLANK,
    GAP,
    GAP_BY_LOAD,
    GEAR_TORQUE,
    held,
    LOAD_ADDED,
    LOAD_ANGLE,
    LOAD_ERROR,
    LOAD_FRICTION,
    LOAD_RATE,
    LOAD_SPEED,
    LOAD_TORQUE,
    MOTOR_ANGLE,
    MOTOR_ERROR,
    MOTOR_FRICTION,
    MOTOR_RATE,
    MOTOR_SPEED,
    MOTOR_TORQUE,
    REST,
    RISE,
    ROTOR_ADDED,
    STIFFNESS,
    stretch,
    tangent,
    TIME,
    TORQUE,
    total,
)

# the state: angles and speeds, current, what hangs on motor and load, the gear, and what fades
STATES = 17
(QM, QL, VM, VL, AMPS, IRATE, RINGS, HUNG, HUNG_RATE, PULL, TOUCH, ZERO, OPENED, SLIPPED, WARMTH,
 STOOD, TURNED) = range(STATES)


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
def directional_friction(laws):
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
def angle_lost(laws, x, motor, load):
    """Return the angle that the gear loses, rad, and its slopes by both angles."""
    x[MOTOR_ANGLE], x[LOAD_ANGLE] = motor, load
    by_motor, slope_m = total(laws, MOTOR_ERROR, x)
    by_load, slope_l = total(laws, LOAD_ERROR, x)
    return by_motor + by_load, slope_m, slope_l


@njit(cache=True, error_model='numpy')
def _sign(speed):
    return 1 if speed > 0.0 else (-1 if speed < 0.0 else 0)


@njit(cache=True, error_model='numpy')
def step(p, laws, memory, z, x, s, command, external, time, directional, h):
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
    _, slope_m, slope_l = angle_lost(laws, x, x[MOTOR_ANGLE], x[LOAD_ANGLE])
    wind = s[QM] / p.ratio - s[QL] - s[SLIPPED] + s[ZERO] - angle_lost(laws, x, s[QM], s[QL])[0]
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
    wind = s[QM] / p.ratio - s[QL] - s[SLIPPED] + s[ZERO] - angle_lost(laws, x, s[QM], s[QL])[0]
    s[PULL], _, _, touch = _gear(p, laws, memory[2], z[2], x, stiffness, gap, s[TOUCH], wind,
                                 to_m * new_m - to_l * new_l)
    if memory[2, 0] > 0.0:
        stretch(memory[2], z[2], touch - s[TOUCH], h)
    s[TOUCH] = touch
