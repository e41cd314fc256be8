"""Friction that varies over the turn."""

from ..effect import Parameter
from ..harmonics import wave
from ..ports import Friction


class PositionDependentFriction(Friction):
    r"""
    A base order of the turn of the shaft and its multiples.

    .. math:: \tau_f = \sum_{i=1}^n a_i \cos(i E\theta) + b_i \sin(i E\theta)

    Flips with the direction, as all friction does. Holds beside friction that is larger: what a
    shaft resists with in all is never below zero.
    """

    source = 'paper 000 eq. 3 and fig. 4; paper 004 eq. 4 (Ghorbel, Gandhi)'

    order = Parameter(1.0, '1/rad', (0.01, 1e5), 'Base order, per turn of the shaft.',
                      grid=(1.0, 2.0))
    cosine = Parameter((0.5,), 'N m', (-1e5, 1e5), 'Of each multiple.', off=0.0)
    sine = Parameter((0.0,), 'N m', (-1e5, 1e5), 'Of each multiple.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return wave(p.cosine, p.sine, p.order * motion.angle)
