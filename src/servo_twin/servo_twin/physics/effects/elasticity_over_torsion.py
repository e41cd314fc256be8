"""Torque of the transmission as any curve over its torsion."""

from ..effect import Parameter
from ..ports import Mesh
from ..spline import spline


class ElasticityOverTorsion(Mesh):
    r"""
    A spline over the size of the torsion, beside the linear stiffness.

    .. math:: T = \mathrm{sgn}(\varphi) \sum_k c_k B_k(|\varphi|)

    Conservative. Beyond the largest torsion it stays as it is there.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False

    low = Parameter(0.0, 'rad', (-1e6, 1e6), 'Lowest torsion of the curve.')
    high = Parameter(1e-3, 'rad', (-1e6, 1e6), 'Highest torsion of the curve.')
    curve = Parameter((1.0,), 'N m', (-1e6, 1e6), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        torque = spline(p.curve, abs(motion.angle), p.low, p.high)
        return torque if motion.angle > 0.0 else -torque
