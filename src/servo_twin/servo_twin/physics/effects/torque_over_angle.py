"""Torque as any curve over the angle of a shaft."""

from ..effect import Parameter
from ..ports import Torque
from ..spline import spline


class TorqueOverAngle(Torque):
    r"""
    A spline over the angle, for what is conservative and neither gravity nor cogging.

    .. math:: \tau = \sum_k c_k B_k(\theta)

    Beyond the lowest and highest angle it stays as it is there.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False

    low = Parameter(-3.0, 'rad', (-1e6, 1e6), 'Lowest angle of the curve.')
    high = Parameter(3.0, 'rad', (-1e6, 1e6), 'Highest angle of the curve.')
    curve = Parameter((0.5,), 'N m', (-1e6, 1e6), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return spline(p.curve, motion.angle, p.low, p.high)
