"""A torque that is always there."""

from ..effect import Parameter
from ..ports import Torque


class ConstantTorque(Torque):
    r"""
    A torque that neither motion nor angle changes.

    .. math:: \tau = \tau_0

    A weight on a slope or on a vertical axis, a counterbalance, the pull of a hose. While the
    shaft moves, friction that differs by direction does the same; at rest this one pushes.
    """

    source = 'any textbook of mechanics'
    candidate = False

    torque = Parameter(1.0, 'N m', (-1e6, 1e6), 'Positive pushes forward.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return p.torque
