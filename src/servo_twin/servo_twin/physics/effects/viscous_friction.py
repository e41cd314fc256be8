"""Friction in proportion to speed."""

from ..effect import Parameter
from ..ports import Friction


class ViscousFriction(Friction):
    r"""
    Drag of a lubricant film.

    .. math:: \tau_f = b\,|\omega|

    Holds for a full film at constant temperature.
    """

    source = 'paper 001 eq. 14'

    slope = Parameter(1.0, 'N m s/rad', (0.0, 1e6), 'Rise with speed.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return p.slope * abs(motion.speed)
