"""Friction that varies over the turn."""

from ..effect import Parameter
from ..elementary import cos_sin
from ..ports import Friction


class PositionDependentFriction(Friction):
    r"""
    One order of the turn of the shaft; several orders are several such effects.

    .. math:: \tau_f = a \cos(E\theta) + b \sin(E\theta)

    Flips with the direction, as all friction does. Holds beside friction that is larger: what a
    shaft resists with in all is never below zero.
    """

    source = 'paper 000 eq. 3 and fig. 4; paper 004 eq. 4 (Ghorbel, Gandhi)'

    order = Parameter(1.0, '1/rad', (0.01, 1e5), 'Periods in one turn of the shaft.',
                      grid=(1.0, 2.0))
    cosine = Parameter(0.5, 'N m', (-1e5, 1e5), 'Amplitude of the cosine.', off=0.0)
    sine = Parameter(0.0, 'N m', (-1e5, 1e5), 'Amplitude of the sine.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        cosine, sine = cos_sin(p.order * motion.angle)
        return p.cosine * cosine + p.sine * sine
