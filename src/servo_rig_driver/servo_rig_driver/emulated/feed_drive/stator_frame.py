r"""
Motor and drive in the frame of the stator: nothing here turns with the rotor but its flux.

.. math:: L\,\frac{d i_{\alpha\beta}}{dt} = u_{\alpha\beta} - R\,i_{\alpha\beta} - e(\theta)\,
          \omega_m, \quad \tau = \tfrac{3}{2}\, e \cdot i

with e the back EMF at one radian a second, fifth and seventh harmonic in it. The phases are
modulated by the middle of their references; what the current loop computes acts a cycle later; the
switches' dead time takes from each phase against its current; two phases are measured, not alike.
"""

from __future__ import annotations

from math import cos, exp, pi, sin, sqrt, tanh

import numba as nb

KNEE = 0.15  # A, below which the dead time of a phase fades
THIRD = 2.0 * pi / 3.0


@nb.njit
def flux_shape(P, angle):
    """Return the back EMF (alpha, beta) at one radian a second of the motor, V s/rad."""
    theta = P.drive_pole_pairs * angle
    size = P.machine_torque_constant / 1.5
    part = P.drive_imperfection * P.drive_emf_harmonics
    c, s = cos(theta), sin(theta)
    if part == 0.0:
        return -size * s, size * c
    c5, s5, c7, s7 = cos(5.0 * theta), sin(5.0 * theta), cos(7.0 * theta), sin(7.0 * theta)
    return -size * (s + part * (s5 + 0.6 * s7)), size * (c + part * (0.6 * c7 - c5))


@nb.njit
def advance_current(P, S, h):
    """Step the winding by h, exactly where voltage and back EMF stand still; return the torque."""
    alpha, beta = S.current_alpha, S.current_beta
    half, other = -0.5 * alpha, 0.5 * sqrt(3.0) * beta
    lost = (P.drive_imperfection * P.drive_dead_time * P.drive_bus_voltage / P.drive_current_cycle)
    a = S.voltages[0] - lost * tanh(alpha / KNEE)
    b = S.voltages[1] - lost * tanh((half + other) / KNEE)
    c = S.voltages[2] - lost * tanh((half - other) / KNEE)
    middle = S.motor_angle + 0.5 * h * S.motor_speed
    e_alpha, e_beta = flux_shape(P, middle)
    keep = exp(-P.drive_resistance / P.drive_inductance * h)
    goal_alpha = ((2.0 * a - b - c) / 3.0 - e_alpha * S.motor_speed) / P.drive_resistance
    goal_beta = ((b - c) / sqrt(3.0) - e_beta * S.motor_speed) / P.drive_resistance
    S.current_alpha = goal_alpha + (alpha - goal_alpha) * keep
    S.current_beta = goal_beta + (beta - goal_beta) * keep
    torque = 1.5 * (e_alpha * 0.5 * (alpha + S.current_alpha)
                    + e_beta * 0.5 * (beta + S.current_beta))
    turns = P.drive_cogging_order * middle
    return torque + P.drive_imperfection * P.drive_cogging_torque * sin(turns)


@nb.njit
def encoder(P, angle):
    """Return the motor's angle in whole counts, rad."""
    step = 2.0 * pi / P.sensors_motor_counts * P.sensors_counts
    return angle if step == 0.0 else step * (angle // step)


@nb.njit
def velocity_loop(P, S):
    """Make the wanted current of the commanded speed."""
    cycle = P.drive_velocity_every * P.drive_current_cycle
    angle = encoder(P, S.motor_angle)
    keep = exp(-cycle / P.drive_velocity_filter) if P.drive_velocity_filter > 0.0 else 0.0
    difference = (angle - S.last_angle) / cycle
    S.speed_estimate = difference + keep * (S.speed_estimate - difference)
    S.last_angle = angle
    if S.mode == 0.0:  # off
        S.wanted, S.velocity_sum = 0.0, 0.0
        return
    if S.mode == 2.0:  # a current is wanted
        S.wanted, S.velocity_sum = S.target, 0.0
    else:
        error = P.drive_command_gain * S.command - S.speed_estimate
        more = P.drive_velocity_gain * cycle / P.drive_velocity_time * error
        S.wanted = P.drive_velocity_gain * error + S.velocity_sum + more
        if abs(S.wanted) < P.drive_current_limit:
            S.velocity_sum += more
    S.wanted = min(max(S.wanted, -P.drive_current_limit), P.drive_current_limit)


@nb.njit
def current_loop(P, S):
    """Measure two phases, and compute the three voltages of the next cycle."""
    theta = P.drive_pole_pairs * S.motor_angle
    i_a = S.current_alpha
    i_b = -0.5 * S.current_alpha + 0.5 * sqrt(3.0) * S.current_beta
    i_b *= 1.0 + P.drive_imperfection * P.drive_sensor_gain
    i_c = -i_a - i_b
    d = 2.0 / 3.0 * (i_a * cos(theta) + i_b * cos(theta - THIRD) + i_c * cos(theta + THIRD))
    q = -2.0 / 3.0 * (i_a * sin(theta) + i_b * sin(theta - THIRD) + i_c * sin(theta + THIRD))
    S.current = q
    S.voltages[:] = S.next_voltages
    if S.mode == 0.0:
        S.sum_d, S.sum_q = 0.0, 0.0
        S.next_voltages[:] = 0.0
        return
    share = P.drive_current_gain * P.drive_current_cycle / P.drive_current_time
    sum_d, sum_q = S.sum_d - share * d, S.sum_q + share * (S.wanted - q)
    u_d = sum_d - P.drive_current_gain * d
    u_q = sum_q + P.drive_current_gain * (S.wanted - q)
    phases = S.next_voltages
    low, high = 1e9, -1e9
    for k in range(3):
        phases[k] = u_d * cos(theta - k * THIRD) - u_q * sin(theta - k * THIRD)
        low, high = min(low, phases[k]), max(high, phases[k])
    if high - low <= P.drive_bus_voltage:
        S.sum_d, S.sum_q = sum_d, sum_q
    else:  # what the legs cannot give is cut off, each for itself
        middle = 0.5 * (low + high)
        for k in range(3):
            phases[k] = min(max(phases[k] - middle, -0.5 * P.drive_bus_voltage),
                            0.5 * P.drive_bus_voltage)


@nb.njit
def drive(P, S, h):
    """Run the loops whose time has come."""
    S.waited += h
    if S.waited > P.drive_current_cycle - 0.5 * h:
        S.waited -= P.drive_current_cycle
        S.runs += 1.0
        if S.runs >= P.drive_velocity_every:
            S.runs = 0.0
            velocity_loop(P, S)
        current_loop(P, S)
