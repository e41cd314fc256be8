"""A transmission whose stiffness grows in proportion to its torsion."""

from ..effect import Parameter
from ..ports import Mesh


class StiffeningSpring(Mesh):
    r"""
    The linear stiffening spring of Hashimoto and Kiyosawa, beside the mechanism's linear one.

    .. math:: K(\varphi) = K + k_1\,|\varphi|, \quad T = k_1\,|\varphi|\,\varphi

    Conservative; not smooth at zero, where a real transmission is. No candidate of a diagnosis:
    there `nonlinear_stiffness` says the same with fewer assumptions. Holds for torsions that were
    measured, not beyond.
    """

    source = 'paper 004 eq. 3 (Hashimoto, Kiyosawa)'
    candidate = False

    rise = Parameter(1e6, 'N m/rad2', (0.0, 1e15), 'Stiffness gained for one radian.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return p.rise * abs(motion.angle) * motion.angle
