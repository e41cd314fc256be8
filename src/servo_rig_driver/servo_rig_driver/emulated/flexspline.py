r"""
The flexspline of a harmonic drive: teeth that come to bear, creep, and an error of its own.

The wall of the cup twists in proportion, the teeth by the logarithm of what they carry,

.. math:: \varphi = T/K + \varphi_t\,\mathrm{asinh}(T/T_t)

which is solved for the torque T. Creep is a Maxwell element beside it. The kinematic error e goes
with the wave generator, and a little with the load: torque on the load :math:`T(1 + e_l)`, on the
motor :math:`T(1/N - e_m)` with its slopes, so that it neither makes nor loses energy.
"""

from math import asinh, cos, sin, sqrt

import numba as nb

from .slip_elements import MESH_REACHES

ROUNDS = 8  # of Newton's iteration; one or two are taken


@nb.njit
def kinematic_error(P, motor, load):
    """Return error (rad at the load) and its slopes over both angles."""
    size = P.flexspline_error * P.flexspline_error_amplitude
    c, s = cos(2.0 * motor + 0.3), sin(2.0 * motor + 0.3)
    with_load = 1.0 + 0.3 * cos(load + 0.8)
    shape, over_motor = s + 0.7 * c * s, 2.0 * c + 1.4 * (c * c - s * s)
    return (size * with_load * shape, size * with_load * over_motor,
            -0.3 * size * sin(load + 0.8) * shape)


@nb.njit
def cup(P, wind_up, torque):
    """Return torque and slope (N m/rad) at a torsion, starting from a torque near by."""
    angle = P.flexspline_stiffening * P.flexspline_tooth_angle
    soft = P.flexspline_tooth_torque
    slope = P.machine_stiffness
    for _ in range(ROUNDS):
        slope = 1.0 / (1.0 / P.machine_stiffness + angle / sqrt(torque * torque + soft * soft))
        missing = wind_up - torque / P.machine_stiffness - angle * asinh(torque / soft)
        torque += slope * missing
        if abs(missing) < 1e-12:
            break
    return torque, slope


@nb.njit
def flexspline(P, S):
    """Set torsion, transmitted torque and slope; return the torques on load and motor."""
    error, over_motor, over_load = kinematic_error(P, S.motor_angle, S.load_angle)
    wind_up = S.motor_angle / P.machine_ratio - S.load_angle - error
    moved = wind_up - S.wind_up
    S.wind_up = wind_up
    S.flex_torque, S.mesh_slope = cup(P, wind_up, S.flex_torque)
    S.creep_torque += P.flexspline_creep * P.flexspline_creep_stiffness * moved
    torque = S.flex_torque + S.creep_torque
    if P.mesh_hysteresis > 0.0:
        for j in range(len(MESH_REACHES)):
            reach = MESH_REACHES[j] * P.mesh_slip_angle
            z = min(max(S.mesh_bristles[j] + moved, -reach), reach)
            S.mesh_bristles[j] = z
            torque += P.mesh_hysteresis * P.mesh_slip_torque / len(MESH_REACHES) * z / reach
    on_load = torque * (1.0 + over_load)
    S.mesh_torque = on_load
    return on_load, torque * (1.0 / P.machine_ratio - over_motor)


@nb.njit
def wave_generator(P, S, level):
    """Return what the wave generator resists with, N m at the motor, from a sliding level."""
    level += (P.flexspline_static * P.flexspline_static_torque
              / (1.0 + abs(S.motor_speed) / P.flexspline_static_speed))
    level *= 1.0 + P.flexspline_turn * P.flexspline_turn_share * cos(2.0 * S.motor_angle - 0.5)
    edge = 0.05 * P.flexspline_tooth_torque
    return level + (P.flexspline_mesh_friction * P.flexspline_mesh_coefficient / P.machine_ratio
                    * (sqrt(S.flex_torque ** 2 + edge * edge) - edge))
