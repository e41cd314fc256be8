"""A gap that varies over the turn."""

from ..effect import Parameter
from ..elementary import cos_sin
from ..ports import Clearance


class PositionDependentBacklash(Clearance):
    r"""
    One order of the turn of the load; several orders are several such effects.

    .. math:: \theta_h = a \cos(E\theta_l) + b \sin(E\theta_l)

    Holds beside a backlash that is wider: the gap in all is never below zero.
    """

    source = 'paper 000 eq. 4 and fig. 6'

    order = Parameter(1.0, '1/rad', (0.01, 1e5), 'Periods in one turn of the load.',
                      grid=(1.0, 2.0))
    cosine = Parameter(1e-4, 'rad', (-1.0, 1.0), 'Amplitude of the cosine.', off=0.0)
    sine = Parameter(0.0, 'rad', (-1.0, 1.0), 'Amplitude of the sine.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        cosine, sine = cos_sin(p.order * motion.load_angle)
        return p.cosine * cosine + p.sine * sine
