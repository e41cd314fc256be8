"""A spring at the load."""

from ..effect import Parameter
from ..ports import Torque


class SpringLoad(Torque):
    r"""
    Linear spring between load and frame.

    .. math:: \tau = -k\,(\theta_l - \theta_0)

    Holds within the travel of the spring.
    """

    source = 'Hooke; any textbook of mechanics'
    sites = ('load',)

    stiffness = Parameter(10.0, 'N m/rad', (0.0, 1e9), 'Rise with angle.', off=0.0)
    rest = Parameter(0.0, 'rad', (-1e4, 1e4), 'Load angle without torque.', grid=(0.0,))

    @staticmethod
    def law(p, s, motion, h):
        return -p.stiffness * (motion.angle - p.rest)
