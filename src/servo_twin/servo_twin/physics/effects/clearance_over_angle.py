"""Clearance as any curve over the turn of the load."""

from ..effect import Parameter
from ..ports import Clearance
from ..spline import turning


class ClearanceOverAngle(Clearance):
    r"""
    A periodic spline over the angle of the load.

    .. math:: \theta_h = \sum_k c_k B_k(\theta_l \bmod 2\pi)

    The gap in all is never below zero. Holds where the turn was passed.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False

    curve = Parameter((1e-4,), 'rad', (-1.0, 1.0), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return turning(p.curve, motion.load_angle)
