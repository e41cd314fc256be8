"""A gap that varies over the turn."""

from ..effect import Parameter
from ..harmonics import wave
from ..ports import Clearance


class PositionDependentBacklash(Clearance):
    r"""
    A base order of the turn of the load and its multiples.

    .. math:: \theta_h = \sum_{i=1}^n a_i \cos(i E\theta_l) + b_i \sin(i E\theta_l)

    Holds beside a backlash that is wider: the gap in all is never below zero.
    """

    source = 'paper 000 eq. 4 and fig. 6'

    order = Parameter(1.0, '1/rad', (0.01, 1e5), 'Base order, per turn of the load.',
                      grid=(1.0, 2.0))
    cosine = Parameter((1e-4,), 'rad', (-1.0, 1.0), 'Of each multiple.', off=0.0)
    sine = Parameter((0.0,), 'rad', (-1.0, 1.0), 'Of each multiple.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return wave(p.cosine, p.sine, p.order * motion.load_angle)
