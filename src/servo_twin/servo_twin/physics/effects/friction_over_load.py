"""Friction as any curve over the load."""

from ..effect import Parameter
from ..ports import Friction
from ..spline import spline


class FrictionOverLoad(Friction):
    r"""
    A spline over the size of the transmitted torque, where no friction law fits.

    .. math:: \tau_f = \sum_k c_k B_k(|T|)

    T is the transmitted torque as this shaft feels it. Beyond the lowest and highest torque it
    stays as it is there.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False

    low = Parameter(0.0, 'N m', (-1e6, 1e6), 'Lowest torque of the curve.')
    high = Parameter(100.0, 'N m', (-1e6, 1e6), 'Highest torque of the curve.')
    curve = Parameter((0.5,), 'N m', (-1e6, 1e6), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return spline(p.curve, abs(motion.torque), p.low, p.high)
