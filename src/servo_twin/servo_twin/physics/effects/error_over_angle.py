"""Kinematic error as any curve over the turn of the load."""

from ..effect import Parameter
from ..ports import MeshError
from ..spline import over_angle


class ErrorOverAngle(MeshError):
    r"""
    A spline over the angle of the load.

    .. math:: \theta_e = \sum_k c_k B_k(\theta_l)

    Independent of load and direction. Between the lowest and the highest angle, and
    beyond as it is there; where these are alike it repeats each turn.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False

    low = Parameter(0.0, 'rad', (-1e6, 1e6), 'Lowest angle of the curve.')
    high = Parameter(0.0, 'rad', (-1e6, 1e6), 'Highest one; the lowest again: a whole turn.')
    curve = Parameter((1e-5,), 'rad', (-0.1, 0.1), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return over_angle(p.curve, motion.load_angle, p.low, p.high)
