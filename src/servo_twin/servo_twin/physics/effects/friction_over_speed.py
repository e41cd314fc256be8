"""Friction as any curve over the speed."""

from ..effect import Parameter
from ..ports import Friction
from ..spline import spline


class FrictionOverSpeed(Friction):
    r"""
    A spline over the size of the speed, where no friction law fits.

    .. math:: \tau_f = \sum_k c_k B_k(|\omega|)

    Beyond the lowest and highest speed it stays as it is there. Holds within the speeds that it
    was found at.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False

    low = Parameter(0.0, 'rad/s', (-1e6, 1e6), 'Lowest speed of the curve.')
    high = Parameter(1.0, 'rad/s', (-1e6, 1e6), 'Highest speed of the curve.')
    curve = Parameter((0.5,), 'N m', (-1e6, 1e6), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return spline(p.curve, abs(motion.speed), p.low, p.high)
