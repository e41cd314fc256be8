r"""
One substep and many: positions and speeds in turn (Strang splitting, second order).

Half a step of current, half a step of everything that is proportional to speed (exactly), half a
kick by the torques that depend on position, a drift, and the same backwards. The damping steps are
exact exponentials, so no damping is ever too large for the step, and elements slip exactly.
"""

from __future__ import annotations

from math import exp, pi, sin, sqrt

import numba as nb

from . import coupled_mass, flexspline, mesh, motor_current, slip_elements
from .rig_state import RING
from .slip_elements import LOAD_REACHES, LOAD_SHARES, MOTOR_REACHES, MOTOR_SHARES

_slide = slip_elements.slide
_load_budget, _motor_budget = slip_elements.load_budget, slip_elements.motor_budget
_wave_generator = flexspline.wave_generator
_load_inertia, _turn_other = coupled_mass.load_inertia, coupled_mass.turn_other
_viscous_slope, _age, _mesh = slip_elements.viscous_slope, slip_elements.age, mesh.mesh
_advance_current, _motor_torque = motor_current.advance_current, motor_current.motor_torque


@nb.njit
def payload_stiffness(P):
    """Return the spring of the payload, N m/rad."""
    return P.withheld_payload_inertia * (2.0 * pi * P.withheld_payload_frequency) ** 2


@nb.njit
def forces(P, S, load_move, motor_move):
    """Set the torques that depend on positions; the elements move by what the shafts did."""
    on_load, on_motor = _mesh(P, S)
    least = max(P.friction_presliding, 0.02)
    reach = P.friction_presliding_angle * least
    load, S.load_stuck = _slide(S.load_bristles, LOAD_SHARES, LOAD_REACHES, load_move,
                                _load_budget(P, S), reach)
    budget = _motor_budget(P, S)
    if P.flexspline_fitted > 0.0:
        budget = _wave_generator(P, S, budget)
    motor, S.motor_stuck = _slide(S.motor_bristles, MOTOR_SHARES, MOTOR_REACHES, motor_move,
                                  budget, reach * P.machine_ratio)
    S.heat = abs(load * S.load_speed) + abs(motor * S.motor_speed)
    angle = S.load_angle
    outside = -S.external * (1.0 + 0.005 * P.load_ripple * sin(70.0 * angle)) + S.reaction
    if P.withheld_gravity > 0.0:
        outside -= P.withheld_gravity * sin(angle - P.withheld_gravity_angle)
    if P.withheld_spring_load > 0.0:
        outside -= P.withheld_spring_load * angle / sqrt(1.0 + 0.25 * angle * angle)
    S.payload_force = payload_stiffness(P) * (angle - S.payload_angle)
    S.load_force = on_load - load + outside - S.payload_force
    S.motor_force = _motor_torque(P, S) - motor - on_motor


@nb.njit
def damp(P, S, h):
    """Let everything proportional to speed act for h, one pair after the other, each exactly."""
    # Bristles that hold ring without this: a tenth of their critical damping.
    inertia = _load_inertia(P, S)
    slope = _viscous_slope(P, P.friction_load_viscous, S.load_speed, 1.0, S.temperature)
    slope += P.withheld_quadratic_drag * sqrt(S.load_speed ** 2 + 1e-6)
    hold = 0.2 * sqrt(S.load_stuck * inertia)
    keep = exp(-(slope + hold) * h / inertia)
    S.heat += slope * S.load_speed ** 2
    S.load_speed *= keep

    slope = _viscous_slope(P, P.friction_motor_viscous, S.motor_speed, P.machine_ratio,
                           S.temperature)
    hold = 0.2 * sqrt(S.motor_stuck * P.machine_rotor_inertia)
    keep = exp(-(slope + hold) * h / P.machine_rotor_inertia)
    S.heat += slope * S.motor_speed ** 2
    S.motor_speed *= keep

    contact = S.mesh_slope / P.machine_stiffness
    couple(P, S, P.machine_damping * P.mesh_damping * contact, h)
    if P.withheld_payload_inertia > 0.0:
        payload = P.withheld_payload_inertia
        both = 1.0 / payload + 1.0 / inertia
        damping = 0.04 * sqrt(payload_stiffness(P) * payload)
        impulse = (S.load_speed - S.payload_speed) * (1.0 - exp(-damping * both * h)) / both
        S.load_speed -= impulse / inertia
        S.payload_speed += impulse / payload
    if P.withheld_slosh > 0.0:
        both = 1.0 / P.withheld_slosh + 1.0 / inertia
        slip = S.load_speed - S.slosh_speed
        damping = 12.0 * P.withheld_slosh * sqrt(abs(slip) + 1e-3)
        impulse = slip * (1.0 - exp(-damping * both * h)) / both
        S.load_speed -= impulse / inertia
        S.slosh_speed += impulse / P.withheld_slosh


@nb.njit
def kick(P, S, h):
    """Let the torques that depend on positions act for h."""
    S.motor_speed += h * S.motor_force / P.machine_rotor_inertia
    S.load_speed += h * S.load_force / _load_inertia(P, S)
    if P.withheld_payload_inertia > 0.0:
        S.payload_speed += h * S.payload_force / P.withheld_payload_inertia
    else:
        S.payload_angle, S.payload_speed = S.load_angle, S.load_speed


@nb.njit
def couple(P, S, damping, h):
    """Damp the torsion rate by an exact exchange of momentum between the shafts."""
    inertia = _load_inertia(P, S)
    inverse = 1.0 / (P.machine_rotor_inertia * P.machine_ratio ** 2) + 1.0 / inertia
    rate = S.motor_speed / P.machine_ratio - S.load_speed
    impulse = rate * (1.0 - exp(-damping * inverse * h)) / inverse
    S.load_speed += impulse / inertia
    S.motor_speed -= impulse / (P.machine_rotor_inertia * P.machine_ratio)


@nb.njit
def surroundings(P, S, h):
    """Step what is slow: load simulator, play under load, warmth, torque sensor, contacts."""
    if P.load_lag > 0.0:
        corner = 2.0 * pi * P.load_bandwidth / P.load_lag
        push = corner * corner * (S.external_target - S.external)
        S.external_rate = (S.external_rate + h * push) / (1.0 + 1.4 * corner * h)
        S.external += h * S.external_rate
    else:
        S.external = S.external_target
    S.slow_torque += (abs(S.mesh_torque) - S.slow_torque) * min(1.0, h / 0.02)
    S.temperature += h / P.thermal_capacity * (
        P.thermal_heating * S.heat - P.thermal_cooling * (S.temperature - P.thermal_room))
    contact = S.mesh_slope / P.machine_stiffness
    twist = S.motor_speed / P.machine_ratio - S.load_speed
    torque = S.mesh_torque + P.machine_damping * P.mesh_damping * contact * twist
    if P.sensors_lag > 0.0:
        follow = 1.0 - exp(-h * 2.0 * pi * P.sensors_torque_bandwidth / P.sensors_lag)
        S.torque_reading += (torque - S.torque_reading) * follow
    else:
        S.torque_reading = torque
    if S.creep_torque != 0.0:
        S.creep_torque *= exp(-h / P.flexspline_creep_time)
    _turn_other(P, S, h)
    _age(P, S, h)


@nb.njit
def advance(P, S, steps, h):
    """Step on by ``steps`` times ``h`` seconds."""
    half = 0.5 * h
    forces(P, S, 0.0, 0.0)
    for _ in range(steps):
        _advance_current(P, S, half)
        damp(P, S, half)
        kick(P, S, half)

        S.motor_angle += h * S.motor_speed
        S.load_angle += h * S.load_speed
        S.payload_angle += h * S.payload_speed
        forces(P, S, h * S.load_speed, h * S.motor_speed)

        kick(P, S, half)
        damp(P, S, half)
        _advance_current(P, S, half)
        surroundings(P, S, h)

        S.time += h
        S.at = (S.at + 1) % RING
        S.commands[S.at] = S.command
        S.load_angles[S.at] = S.load_angle
