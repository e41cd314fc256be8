r"""
Friction by elasto-plastic elements (Maxwell slip) whose budget varies.

An element follows the shaft and slips at its share of the budget: :math:`|k_i z_i| \le F_i`. The
budget of the load bearing is a product,

.. math:: F = F_0\,A(a)\,P(\theta)\,D(\omega)\,e^{-\gamma\Delta T} + \mu(\sqrt{T^2+T_0^2}-T_0)

with the ageing of the contacts :math:`A = 1 + B \ln(1 + \omega_s a)`, :math:`\dot a = 1/d -
|\omega| a / d` (rate and state, Dieterich 1979, Ruina 1983), so that the level falls with the
logarithm of speed and lags behind it. The level varies over the turn in the form of von Mises'
density. The lubricant thins as Eyring's fluid, :math:`c\,\omega_e
\mathrm{asinh}(\omega/\omega_e)`.
"""

from math import asinh, cos, exp, log1p, pi, sqrt

import numba as nb

OLDEST = 1e4  # s/rad
WEAKENING = 0.06

LOAD_SHARES = (0.28, 0.27, 0.25, 0.20)
LOAD_REACHES = (0.25, 0.6, 1.2, 2.4)
MOTOR_SHARES = (0.55, 0.45)
MOTOR_REACHES = (0.6, 1.5)
MESH_REACHES = (0.4, 1.0, 2.0)


@nb.njit
def slide(deflections, shares, reaches, move, budget, reach):
    """Move elements and let them slip; return their force and the stiffness of those that hold."""
    force, held = 0.0, 0.0
    for k in range(len(shares)):
        limit = reaches[k] * reach
        # the stiffness follows the budget, so that the reach stays what it is
        z = deflections[k] + move
        stiffness = shares[k] * budget / limit
        if z >= limit:
            z = limit
        elif z <= -limit:
            z = -limit
        else:
            held += stiffness
        deflections[k] = z
        force += stiffness * z
    return force, held


@nb.njit
def over_the_turn(angle):
    """Return the variation of the friction over the load turn; its mean over the turn is zero."""
    narrow = exp(6.0 * (cos(angle + 2.0) - 1.0)) - 0.166657
    broad = exp(2.0 * (cos(angle - 1.0) - 1.0)) - 0.308508
    return 0.20 * broad + 0.14 * narrow


@nb.njit
def load_budget(P, S):
    """Return what the load's bearing and the loaded mesh can resist with, N m."""
    warm = exp(-0.004 * P.friction_temperature * (S.temperature - 25.0))
    level = P.friction_load_coulomb * P.friction_load_level * P.friction_level * warm
    if P.friction_weakening > 0.0:
        level *= 1.0 + WEAKENING * P.friction_weakening * log1p(P.friction_fade_speed * S.age)
    if P.friction_position > 0.0:
        level *= max(0.0, 1.0 + P.friction_position * over_the_turn(S.load_angle))
    if P.friction_asymmetry != 0.0:
        way = 1.0 if S.load_speed > 0.0 else -1.0
        level *= max(0.0, 1.0 + 0.05 * P.friction_asymmetry * way)
    level *= 1.0 + P.withheld_friction_drift / (1.0 + S.time / P.withheld_friction_drift_time)
    edge = 0.05 * P.friction_load_coulomb
    level += (P.friction_load * P.friction_load_coefficient
              * (sqrt(S.mesh_torque ** 2 + edge * edge) - edge))
    level += P.withheld_load_drag
    if P.withheld_local_spot > 0.0:
        away = (S.load_angle - P.withheld_local_spot_angle) / P.withheld_local_spot_width
        if abs(away) < 1.0:
            level += P.withheld_local_spot * (1.0 - away * away) ** 2
    if P.withheld_rest_ageing > 0.0:
        level += P.withheld_rest_ageing * 0.43429448 * log1p(S.rest / 0.02)
    return level


@nb.njit
def brake(P, S):
    """
    Return what the disc brake holds with, N m at the motor.

    The mean is what was asked; the disc wobbles, the control of its force oscillates and is
    begun again, somewhere in its period, each time the rig is switched on.
    """
    if P.brake_torque == 0.0:
        return 0.0
    level = 1.0 + 0.03 * P.brake_runout * cos(S.motor_angle + 0.8)
    level += 0.04 * P.brake_swing * cos(2.0 * pi * P.brake_frequency * S.time + S.brake_phase)
    level += 0.05 * P.brake_grip / (1.0 + abs(S.motor_speed) / P.brake_fade_speed)
    return P.brake_torque * max(0.0, level)


@nb.njit
def motor_budget(P, S):
    """Return what the motor's bearings and seals can resist with, N m at the motor."""
    warm = exp(-0.004 * P.friction_temperature * (S.temperature - 25.0))
    return (P.friction_motor_coulomb * P.friction_motor_level * P.friction_level * warm
            + P.withheld_motor_drag + brake(P, S))


@nb.njit
def viscous_slope(P, slope, speed, scale, temperature):
    """Return the secant of the viscous torque, N m s/rad: torque over speed."""
    warm = exp(-0.02 * P.friction_temperature * (temperature - 25.0))
    slope = slope * P.friction_viscous * warm
    fast = abs(speed) * P.friction_thinning / (scale * P.friction_shear_speed)
    if fast < 1e-4:
        return slope
    return slope * asinh(fast) / fast


@nb.njit
def age(P, S, h):
    """Renew the contacts of the load over the step h and keep the time of rest."""
    speed = abs(S.load_speed)
    rate = speed / P.friction_renewal_angle
    if rate * h > 1e-6:
        steady = 1.0 / speed
        S.age = steady + (S.age - steady) * exp(-rate * h)
    else:
        S.age += h / P.friction_renewal_angle
    S.age = min(S.age, OLDEST)
    S.rest = S.rest + h if S.load_stuck > 0.0 and speed < 1e-3 else S.rest * exp(-h / 0.01)
