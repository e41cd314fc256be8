"""Weight on a lever at the load."""

from ..effect import Parameter
from ..elementary_functions import cos_sin
from ..ports import Torque


class Gravity(Torque):
    r"""
    First order of the load turn.

    .. math:: \tau = a \cos(E\theta_l) + b \sin(E\theta_l), \quad E = 1

    Conservative; amplitude and phase follow from mass, lever and the zero of the encoder. Holds
    for an axis that stays as it is mounted.
    """

    source = 'weight times lever; any textbook of mechanics'
    sites = ('load',)

    cosine = Parameter(10.0, 'N m', (-1e6, 1e6), 'Torque at angle zero.', off=0.0)
    sine = Parameter(0.0, 'N m', (-1e6, 1e6), 'Torque a quarter turn on.', off=0.0)
    order = Parameter(1.0, '1/rad', (0.01, 1e3), 'Periods in one turn of the load.',
                      told=False)

    @staticmethod
    def law(p, s, motion, h):
        cosine, sine = cos_sin(p.order * motion.angle)
        return p.cosine * cosine + p.sine * sine
