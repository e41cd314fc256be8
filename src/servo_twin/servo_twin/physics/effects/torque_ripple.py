"""Torque constant that varies over the turn of the motor."""

from ..effect import Parameter
from ..harmonics import wave
from ..ports import Torque


class TorqueRipple(Torque):
    r"""
    A base order of the motor turn and its multiples, in proportion to the current.

    .. math:: \tau = i \sum_{j=1}^n a_j \cos(j E \theta_m) + b_j \sin(j E \theta_m)

    Harmonics of the back EMF; holds below saturation of the iron. An offset of a phase current
    would be there at zero current as well, as cogging is.
    """

    source = 'Holtz, Springob: IEEE Trans. Ind. Electron. 43(2), 1996'
    sites = ('motor',)

    order = Parameter(24.0, '1/rad', (0.1, 1e5), 'Base order, per turn of the motor.',
                      grid=(4.0, 6.0, 12.0, 24.0, 30.0))
    cosine = Parameter((0.01,), 'N m/A', (-1e5, 1e5), 'Of each multiple.', off=0.0)
    sine = Parameter((0.0,), 'N m/A', (-1e5, 1e5), 'Of each multiple.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.current * wave(p.cosine, p.sine, p.order * motion.angle)
