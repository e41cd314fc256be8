"""Friction that grows with the torque the teeth carry."""

from ..effect import Parameter
from ..ports import Friction


class LoadDependentFriction(Friction):
    r"""
    Friction of loaded teeth and bearings.

    .. math:: \tau_f = \left(\mu + \mu_b\,[T\omega < 0]\right) |T|

    T is the transmitted torque as this shaft feels it; the load drives the motor back where T and
    the motion differ in sign. Neither share is below zero, or the two together would be a torque
    that is misread. Holds while the pressure of the teeth follows the torque.
    """

    source = 'Duclusaud, Passault, Padois, Ly: arXiv 2410.08650, 2024, load-dependent models'

    share = Parameter(0.05, '', (0.0, 2.0), 'Friction for a torque of one.', off=0.0)
    back_driven = Parameter(0.0, '', (0.0, 2.0), 'Added while the load drives.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        share = p.share
        if motion.torque * motion.direction < 0.0:
            share += p.back_driven
        return share * abs(motion.torque)
