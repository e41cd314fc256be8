"""Friction as any curve over the time of a run."""

from ..effect import Parameter
from ..ports import Friction
from ..spline import spline


class FrictionOverTime(Friction):
    r"""
    A spline over the time since the start of the run, as a machine warms up.

    .. math:: \tau_f = \sum_k c_k B_k(t)

    After the longest recording it stays as it is there.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False

    low = Parameter(0.0, 's', (-1e6, 1e6), 'Lowest time of the curve.')
    high = Parameter(10.0, 's', (-1e6, 1e6), 'Highest time of the curve.')
    curve = Parameter((0.5,), 'N m', (-1e6, 1e6), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return spline(p.curve, motion.time, p.low, p.high)
