"""Drag that grows with the square of the speed."""

from ..effect import Parameter
from ..ports import Friction


class QuadraticDrag(Friction):
    r"""
    Churning of oil and air at high speed.

    .. math:: \tau_f = c\,\omega^2

    Holds for turbulent flow; a laminar film is viscous.
    """

    source = 'White: Fluid Mechanics, drag of immersed bodies'

    rise = Parameter(1.0, 'N m s2/rad2', (0.0, 1e6), 'Rise with speed squared.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return p.rise * motion.speed * motion.speed
