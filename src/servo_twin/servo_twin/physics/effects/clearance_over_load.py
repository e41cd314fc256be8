"""Clearance as any curve over the load."""

from ..effect import Parameter
from ..ports import Clearance
from ..spline import spline


class ClearanceOverLoad(Clearance):
    r"""
    A spline over the size of the transmitted torque.

    .. math:: \theta_h = \sum_k c_k B_k(|T|)

    T follows the transmitted torque with a lag of ``settling``, as in load_dependent_backlash.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False
    memory = 1

    low = Parameter(0.0, 'N m', (-1e6, 1e6), 'Lowest torque of the curve.')
    high = Parameter(100.0, 'N m', (-1e6, 1e6), 'Highest torque of the curve.')
    curve = Parameter((1e-4,), 'rad', (-1.0, 1.0), 'Coefficients of the spline.',
                      off=0.0)
    settling = Parameter(0.01, 's', (0.0, 10.0), 'Time in which the gap follows the load.')

    @staticmethod
    def law(p, s, motion, h):
        load = abs(motion.torque)
        if h > 0.0:
            load = s[0] + h / (h + p.settling) * (load - s[0])
        s[0] = load
        return spline(p.curve, load, p.low, p.high)
