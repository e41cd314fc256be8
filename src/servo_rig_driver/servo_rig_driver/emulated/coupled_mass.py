r"""
What an axis carries that another axis turns: a mass whose distance from it changes.

A mass m in front of the elevation axis by r, and above it by o, is at

.. math:: J(\epsilon) = m (r \cos\epsilon - o \sin\epsilon)^2

about the azimuth. Its angular momentum stays while it moves outwards, and the turning azimuth
pulls it outwards with :math:`\frac12 J'(\epsilon)\,\omega^2` on the elevation.
"""

from math import cos, sin

import numba as nb


@nb.njit
def load_inertia(P, S):
    """Return the inertia about the load shaft, kg m^2."""
    if P.coupling_mass == 0.0:
        return P.machine_load_inertia
    angle = P.coupling_angle + S.other_angle
    arm = P.coupling_reach * cos(angle) - P.coupling_offset * sin(angle)
    return P.machine_load_inertia + P.coupling_mass * arm * arm


@nb.njit
def inertia_slope(P, S):
    """Return how the inertia grows with the angle of the other axis, kg m^2/rad."""
    angle = P.coupling_angle + S.other_angle
    arm = P.coupling_reach * cos(angle) - P.coupling_offset * sin(angle)
    return -2.0 * P.coupling_mass * arm * (P.coupling_reach * sin(angle)
                                           + P.coupling_offset * cos(angle))


@nb.njit
def turn_other(P, S, h):
    """Let the other axis turn for h: the inertia changes, the angular momentum does not."""
    if S.other_speed == 0.0 or P.coupling_mass == 0.0:
        return
    before = load_inertia(P, S)
    S.other_angle += h * S.other_speed
    if P.coupling_reaction > 0.0:
        after = load_inertia(P, S)
        S.load_speed *= (before / after) ** P.coupling_reaction
