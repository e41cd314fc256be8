"""Friction that does not care how fast the shaft turns."""

from ..effect import Parameter
from ..ports import Friction


class CoulombFriction(Friction):
    r"""
    Dry friction.

    .. math:: \tau_f = \tau_c

    Holds for steady sliding; at rest it resists with at most the same level.
    """

    source = 'paper 001 eq. 14'

    level = Parameter(1.0, 'N m', (0.0, 1e5), 'What it resists with at any speed.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return p.level
