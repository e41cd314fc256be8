"""Torque as any curve over the motor current."""

from ..effect import Parameter
from ..ports import Torque
from ..spline import spline


class TorqueOverCurrent(Torque):
    r"""
    A spline over the size of the current, beside the torque constant.

    .. math:: \tau = \mathrm{sgn}(i) \sum_k c_k B_k(|i|)

    Beyond the largest current it stays as it is there.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False
    sites = ('motor',)

    low = Parameter(0.0, 'A', (-1e6, 1e6), 'Lowest current of the curve.')
    high = Parameter(10.0, 'A', (-1e6, 1e6), 'Highest current of the curve.')
    curve = Parameter((0.5,), 'N m', (-1e6, 1e6), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        torque = spline(p.curve, abs(motion.current), p.low, p.high)
        return torque if motion.current > 0.0 else -torque
