"""Friction that differs by direction."""

from ..effect import Parameter
from ..ports import Friction


class AsymmetricFriction(Friction):
    r"""
    A share that one direction has more and the other has less.

    .. math:: \tau_f = (\tau_a + b_a\,|\omega|)\,\mathrm{sgn}(\omega)

    Holds beside friction that is larger: what a shaft resists with in all is never below zero.
    """

    source = 'Armstrong-Helouvry: Control of Machines with Friction, 1991, direction dependence'

    difference = Parameter(0.5, 'N m', (-1e5, 1e5), 'More forward, less in reverse.', off=0.0)
    slope = Parameter(0.5, 'N m s/rad', (-1e5, 1e5), 'The same, of what grows with speed.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return (p.difference + p.slope * abs(motion.speed)) * motion.direction
