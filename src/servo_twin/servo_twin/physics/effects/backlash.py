"""A gap between the teeth."""

from ..effect import Parameter
from ..ports import Clearance


class Backlash(Clearance):
    r"""
    Dead zone of fixed width.

    .. math:: \theta_h = 2 b

    The teeth carry no torque while the torsion is inside the gap.
    """

    source = 'Nordin, Gutman: Automatica 38(10), 2002, dead-zone model; paper 001 eq. 9'

    width = Parameter(1e-3, 'rad', (0.0, 1.0), 'From one flank to the other.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return p.width
