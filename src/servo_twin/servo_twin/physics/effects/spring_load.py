"""A spring at the load."""

from ..effect import Parameter
from ..ports import Torque


class SpringLoad(Torque):
    r"""
    Linear spring between load and frame, as it was mounted: with a preload.

    .. math:: \tau = \tau_0 - k\,\theta_l

    Holds within the travel of the spring, which is at rest at :math:`\tau_0 / k`.
    """

    source = 'Hooke; any textbook of mechanics'
    sites = ('load',)

    stiffness = Parameter(10.0, 'N m/rad', (0.0, 1e9), 'Rise with angle.', off=0.0)
    preload = Parameter(0.0, 'N m', (-1e6, 1e6), 'Torque at load angle zero.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return p.preload - p.stiffness * motion.angle
