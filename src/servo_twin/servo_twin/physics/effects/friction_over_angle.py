"""Friction as any curve over the turn."""

from ..effect import Parameter
from ..ports import Friction
from ..spline import over_angle


class FrictionOverAngle(Friction):
    r"""
    A spline over the angle of the shaft.

    .. math:: \tau_f = \sum_k c_k B_k(\theta)

    Flips with the direction, as all friction does. Between the lowest and the highest angle, and
    beyond as it is there; where these are alike it repeats each turn.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False

    low = Parameter(0.0, 'rad', (-1e6, 1e6), 'Lowest angle of the curve.')
    high = Parameter(0.0, 'rad', (-1e6, 1e6), 'Highest one; the lowest again: a whole turn.')
    curve = Parameter((0.5,), 'N m', (-1e6, 1e6), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return over_angle(p.curve, motion.angle, p.low, p.high)
