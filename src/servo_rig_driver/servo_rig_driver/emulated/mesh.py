r"""
The mesh: tooth pairs that come to bear one by one, each flank with an error of its own.

Pair j bears on the forward flank once :math:`x_j = w - e_f(\theta_l) - b - s_j > 0` with :math:`w
= \theta_m/N - \theta_l`, and on the reverse flank likewise with :math:`e_r`. The torque is the sum
of their springs; where few pairs bear, the mesh is soft. The backlash 2b is larger under load,
varies over the turn and opens with the slide that carries the encoder. The flanks' errors change
the ratio at once, so the torque on the load is :math:`T(1 + e')` and the mesh neither makes nor
loses energy by them.
"""

from math import acos, cos, sin, sqrt, tan

import numba as nb

from .flexspline import flexspline
from .slip_elements import MESH_REACHES

PAIRS = 5
STAGGER = (0.0, 0.15, 0.35, 0.6, 1.0)
EDGE = 1e-6  # rad, rounding of the first contact


@nb.njit
def flank_errors(P, angle):
    """Return error and slope of the forward flank, then of the reverse flank: rad, rad/rad."""
    forward = forward_slope = reverse = reverse_slope = 0.0
    if P.error_tooth > 0.0:
        order = P.error_order
        c, s = cos(order * angle), sin(order * angle)
        c2, s2 = c * c - s * s, 2.0 * c * s
        c3, s3 = c2 * c - s2 * s, s2 * c + c2 * s
        size = P.error_tooth * P.error_amplitude
        forward += size * (c + 0.45 * s2 + 0.2 * c3)
        forward_slope += size * order * (-s + 0.9 * c2 - 0.6 * s3)
        other = P.error_direction
        reverse += size * ((1.0 - 0.3 * other) * c - 0.5 * other * s + 0.45 * s2 + 0.2 * c3
                           + 0.15 * other * c2)
        reverse_slope += size * order * (-(1.0 - 0.3 * other) * s - 0.5 * other * c + 0.9 * c2
                                         - 0.6 * s3 - 0.3 * other * s2)
    if P.error_turn > 0.0:
        c, s = cos(angle + 0.4), sin(angle + 0.4)
        size = P.error_turn * P.error_turn_amplitude
        both = size * (s + c * s)
        slope = size * (c + c * c - s * s)
        forward, reverse = forward + both, reverse + both
        forward_slope, reverse_slope = forward_slope + slope, reverse_slope + slope
    return forward, forward_slope, reverse, reverse_slope


@nb.njit
def involute(angle):
    """Return tan(angle) - angle, rad."""
    return tan(angle) - angle


@nb.njit
def carrier_play(P):
    r"""
    Return the backlash that the slide of the encoder opens, rad at the load.

    Two equal involute gears whose shafts are :math:`a' = a + x` apart bear at the pressure angle
    :math:`\cos\alpha' = (a / a') \cos\alpha` and have the backlash
    :math:`2 a' (\mathrm{inv}\,\alpha' - \mathrm{inv}\,\alpha)` on circles of radius a'/2.
    Flanks that are arcs leave them at root and tip, so the backlash is larger at both ends.
    """
    x = P.carrier_setting - P.carrier_zero
    if x <= 0.0:
        return 0.0
    apart = P.carrier_base + x
    alpha = P.carrier_pressure_angle
    bearing = acos(P.carrier_base / apart * cos(alpha))
    play = 4.0 * (involute(bearing) - involute(alpha))
    depth = x / P.carrier_depth
    printed = 0.00025 * P.carrier_arc * (2.0 * depth - 1.0) ** 4 * min(1.0, 8.0 * depth)
    printed += 0.00003 * P.carrier_waviness * sin(9.0 * depth)
    return max(0.0, play + printed / P.carrier_radius)


@nb.njit
def half_play(P, S):
    """Return half the free play at the load, rad."""
    if P.mesh_backlash == 0.0:
        return 0.0
    c = cos(S.load_angle - 0.7)
    play = 0.5 * (P.mesh_gap + carrier_play(P)) * P.mesh_backlash
    play *= max(0.0, 1.0 + 0.35 * P.mesh_backlash_position * (0.7 * c + 0.6 * c * c - 0.3))
    wide = S.slow_torque / (S.slow_torque + P.mesh_opening_torque)
    return play * (1.0 + 0.5 * P.mesh_backlash_load * wide)


@nb.njit
def flank(P, wind_up, play):
    """Return torque and slope of one flank: N m, N m/rad."""
    torque = slope = 0.0
    per_pair = P.machine_stiffness / PAIRS
    for j in range(PAIRS):
        x = wind_up - play - STAGGER[j] * P.mesh_stagger * P.mesh_softening
        root = sqrt(x * x + EDGE * EDGE)
        torque += per_pair * 0.5 * (x + root)
        slope += per_pair * 0.5 * (1.0 + x / root)
    return torque, slope


@nb.njit
def mesh(P, S):
    """Set torsion, transmitted torque and slope; return the torques on load and motor."""
    if P.flexspline_fitted > 0.0:
        return flexspline(P, S)
    wind_up = S.motor_angle / P.machine_ratio - S.load_angle
    forward, forward_slope, reverse, reverse_slope = flank_errors(P, S.load_angle)
    play = half_play(P, S)
    ahead, ahead_slope = flank(P, wind_up - forward, play)
    behind, behind_slope = flank(P, reverse - wind_up, play)
    micro = 0.0
    if P.mesh_hysteresis > 0.0:
        for j in range(len(MESH_REACHES)):
            reach = MESH_REACHES[j] * P.mesh_slip_angle
            z = S.mesh_bristles[j] + wind_up - S.wind_up
            z = min(max(z, -reach), reach)
            S.mesh_bristles[j] = z
            micro += P.mesh_hysteresis * P.mesh_slip_torque / len(MESH_REACHES) * z / reach
    S.wind_up = wind_up
    S.mesh_slope = ahead_slope + behind_slope
    on_motor = ahead - behind + micro
    on_load = ahead * (1.0 + forward_slope) - behind * (1.0 + reverse_slope) + micro
    S.mesh_torque = on_load
    return on_load, on_motor / P.machine_ratio
