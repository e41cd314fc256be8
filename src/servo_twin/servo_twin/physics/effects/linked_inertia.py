"""Inertia that varies over the turn of the load, as that of a crank or a linkage."""

from ..effect import Parameter
from ..harmonics import wave, wave_slope
from ..ports import Inertia


class LinkedInertia(Inertia):
    r"""
    A base order of the turn of the load and its multiples, beside the least of them.

    .. math:: J = \sum_{i=1}^n \sqrt{a_i^2 + b_i^2} + a_i \cos(i E\theta_l)
              + b_i \sin(i E\theta_l), \quad
              T = J\,\dot\omega + \tfrac12 J'(\theta_l)\,\omega^2

    It is never below zero, so that no values make the inertia of the load negative; its mean is
    the sum of the roots. Holds for a linkage that is stiff. A diagnosis calls it an error of the
    load's inertia.
    """

    source = 'Wilson, Sadler: Kinematics and Dynamics of Machinery, 1991 (inertia of a crank)'
    candidate = False

    order = Parameter(2.0, '1/rad', (0.01, 1e5), 'Base order, per turn of the load.',
                      grid=(1.0, 2.0))
    cosine = Parameter((0.1,), 'kg m2', (-1e6, 1e6), 'Of each multiple.', off=0.0)
    sine = Parameter((0.0,), 'kg m2', (-1e6, 1e6), 'Of each multiple.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        least = 0.0
        for i in range(len(p.cosine)):
            least += (p.cosine[i] ** 2 + p.sine[i] ** 2) ** 0.5
        return least + wave(p.cosine, p.sine, p.order * motion.angle)

    @staticmethod
    def angle_slope(p, motion):
        """Return how the inertia grows with the angle of the load, kg m2/rad."""
        return p.order * wave_slope(p.cosine, p.sine, p.order * motion.angle)
