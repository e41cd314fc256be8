"""Kinematic error as any curve over the turn of the load."""

from ..effect import Parameter
from ..ports import MeshError
from ..spline import turning


class ErrorOverAngle(MeshError):
    r"""
    A periodic spline over the angle of the load.

    .. math:: \theta_e = \sum_k c_k B_k(\theta_l \bmod 2\pi)

    Independent of load and direction. Holds where the turn was passed.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False

    curve = Parameter((1e-5,), 'rad', (-0.1, 0.1), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return turning(p.curve, motion.load_angle)
