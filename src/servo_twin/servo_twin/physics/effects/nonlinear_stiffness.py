"""A transmission softer at small, or harder at large, torque than its linear stiffness."""

from math import sqrt

from ..effect import Parameter
from ..ports import Mesh


class NonlinearStiffness(Mesh):
    r"""
    What differs from the linear stiffness of the mechanism.

    .. math:: T = k_3\,\varphi^3 - \frac{k_s\,\varphi}{\sqrt{1 + (\varphi/\varphi_0)^2}}

    Conservative. ``soft`` must stay below the linear stiffness, or the transmission would push the
    teeth apart; the cubic holds for torsions that were measured, not beyond.
    """

    source = 'paper 004 eq. 7 (Tjahjowidodo, Al-Bender, Van Brussel) for the cubic'

    cubic = Parameter(0.0, 'N m/rad3', (-1e18, 1e18), 'Hardening, or softening below 0.', off=0.0)
    soft = Parameter(1e5, 'N m/rad', (0.0, 1e10), 'Stiffness that lacks at zero torque.', off=0.0)
    reach = Parameter(1e-4, 'rad', (1e-9, 10.0), 'Torsion over which the lack is made up.',
                      grid=(3e-5, 1e-4, 3e-4))

    @staticmethod
    def law(p, s, motion, h):
        angle = motion.angle
        beyond = angle / p.reach
        return angle * (p.cubic * angle * angle - p.soft / sqrt(1.0 + beyond * beyond))
