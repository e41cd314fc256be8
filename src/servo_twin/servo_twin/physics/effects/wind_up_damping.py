"""Damping of the transmission that rises with the rate of the torsion."""

from ..effect import Parameter
from ..ports import Mesh


class WindUpDamping(Mesh):
    r"""
    What the damping of the mechanism, which is linear, leaves out.

    .. math:: T = c_2\,|\dot\varphi|\,\dot\varphi

    Holds for squeezed lubricant between teeth that touch; in the gap there is none.
    """

    source = 'paper 004 eq. 5 (Ghorbel, Dhaouadi): spring with nonlinear damping'
    candidate = False

    rise = Parameter(1e3, 'N m s2/rad2', (0.0, 1e9), 'Rise with the rate squared.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return p.rise * abs(motion.rate) * motion.rate
