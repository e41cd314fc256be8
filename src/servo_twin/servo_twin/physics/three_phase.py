r"""
Three phases as two numbers, and the inverter that feeds them.

Amplitudes are kept (the form with 2/3): a vector of the stator is as long as the peak of a phase.
The rotor frame has d along the magnets; its angle is that of the rotor times the pole pairs.
Source: paper 001 section 2.3 and its reference 45 (space vector control), eq. 16, 17 and 20.
"""

from math import sqrt

from numba import njit

from .elementary_functions import fused

_ROOT3 = sqrt(3.0)


@njit(error_model='numpy')
def clarke(a, b, c):
    """Return the vector (alpha, beta) in the stator frame of three phases; their mean drops."""
    return (2.0 * a - b - c) / 3.0, (b - c) / _ROOT3


@njit(error_model='numpy')
def phases(alpha, beta):
    """Return the three phases of a vector in the stator frame: Clarke's inverse, mean zero."""
    half, other = -0.5 * alpha, 0.5 * _ROOT3 * beta
    return alpha, half + other, half - other


@njit(error_model='numpy')
def park(alpha, beta, c, s):
    """Return (d, q) of a vector in the stator frame; ``c``, ``s`` of the rotor's angle."""
    return c * alpha + s * beta, c * beta - s * alpha


@njit(error_model='numpy')
def stator(d, q, c, s):
    """Return (alpha, beta) of a vector in the rotor frame: Park's inverse."""
    return c * d - s * q, s * d + c * q


@njit(error_model='numpy')
def turned_back(d, q, angle):
    """
    Return what a vector that stands in the stator frame is in a rotor frame ``angle`` further on.

    By the series of sine and cosine: good to 1e-9 of it while abs(angle) is below 0.05 rad.
    """
    square = angle * angle
    c = fused(square, fused(square, 1.0 / 24.0, -0.5), 1.0)
    s = fused(angle * square, fused(square, 1.0 / 120.0, -1.0 / 6.0), angle)
    return fused(c, d, s * q), fused(c, q, -s * d)


@njit(error_model='numpy')
def duties(alpha, beta, bus):
    """
    Return the shares of a cycle for which the three upper switches conduct, each 0 to 1.

    Space vector modulation in the three steps of figure 6 of paper 001: the sector of the wanted
    voltage (V, stator frame), the durations of the two vectors beside it, the thresholds. What
    lies beyond the hexagon of a bus of ``bus`` V is drawn back to it, at the same angle.
    """
    x = _ROOT3 * beta / bus
    y = (0.5 * _ROOT3 * beta + 1.5 * alpha) / bus
    z = (0.5 * _ROOT3 * beta - 1.5 * alpha) / bus
    sector = (x > 0.0) + 2 * (z < 0.0) + 4 * (y < 0.0)
    if sector == 1:
        first, second = z, y
    elif sector == 2:
        first, second = y, -x
    elif sector == 3:
        first, second = -z, x
    elif sector == 4:
        first, second = -x, z
    elif sector == 5:
        first, second = x, -y
    else:
        first, second = -y, -z
    both = first + second
    if both > 1.0:
        first, second, both = first / both, second / both, 1.0
    low = 0.5 * (1.0 - both)  # of the phase that conducts least
    high = low + both
    if sector == 1:
        return low + second, high, low
    if sector == 2:
        return high, low, low + second
    if sector == 3:
        return high, low + second, low
    if sector == 4:
        return low, low + second, high
    if sector == 5:
        return low, high, low + second
    return low + second, low, high


@njit(error_model='numpy')
def averaged(alpha, beta, bus):
    """
    Return the voltage that the inverter gives on average over a cycle, V, stator frame.

    Within the circle that the hexagon holds that is the wanted voltage itself.
    """
    if 3.0 * (alpha * alpha + beta * beta) <= bus * bus:
        return alpha, beta
    a, b, c = duties(alpha, beta, bus)
    return clarke(bus * a, bus * b, bus * c)


@njit(error_model='numpy')
def winding(d, q, voltage_d, voltage_q, omega, resistance, d_inductance, q_inductance, flux, h):
    r"""
    Return the currents (d, q) of a permanent-magnet winding h later, A.

    .. math:: L_d\dot i_d = u_d - R i_d + \omega L_q i_q, \quad
              L_q\dot i_q = u_q - R i_q - \omega (L_d i_d + \psi)

    with ``omega`` the electrical speed, rad/s, ``flux`` that of the magnets, V s. Implicit
    midpoint, the cross terms by two rounds from the beginning's: second order, good for
    resistance of any size and while the rotor turns by less than a radian in ``h``. Source: paper
    001 eq. 16 to 19; saturation and iron losses are left out.
    """
    half = 0.5 * h
    inverse_d = 1.0 / (d_inductance + half * resistance)
    inverse_q = 1.0 / (q_inductance + half * resistance)
    turn_d = half * q_inductance * inverse_d * omega
    turn_q = half * d_inductance * inverse_q * omega
    given_d = fused(d_inductance * inverse_d, d, half * inverse_d * voltage_d)
    given_q = fused(q_inductance * inverse_q, q, half * inverse_q * fused(-omega, flux, voltage_q))
    middle_d, middle_q = fused(turn_d, q, given_d), fused(-turn_q, d, given_q)
    again_d, again_q = fused(turn_d, middle_q, given_d), fused(-turn_q, middle_d, given_q)
    return fused(2.0, again_d, -d), fused(2.0, again_q, -q)
