"""Friction as any curve over the turn."""

from ..effect import Parameter
from ..ports import Friction
from ..spline import turning


class FrictionOverAngle(Friction):
    r"""
    A periodic spline over the angle of the shaft.

    .. math:: \tau_f = \sum_k c_k B_k(\theta \bmod 2\pi)

    Flips with the direction, as all friction does. Holds where the turn was passed.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False

    curve = Parameter((0.5,), 'N m', (-1e6, 1e6), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return turning(p.curve, motion.angle)
