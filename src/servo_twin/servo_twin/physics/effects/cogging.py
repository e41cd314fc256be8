"""Torque of the magnets on the teeth of the stator."""

from ..effect import Parameter
from ..harmonics import wave
from ..ports import Torque


class Cogging(Torque):
    r"""
    A base order of the motor turn and its multiples.

    .. math:: \tau = \sum_{i=1}^n a_i \cos(i E \theta_m) + b_i \sin(i E \theta_m)

    Conservative, and there at zero current; the base order is the least common multiple of slots
    and poles, or one where the machine is uneven. Holds below saturation of the iron.
    """

    source = 'Holtz, Springob: IEEE Trans. Ind. Electron. 43(2), 1996'
    sites = ('motor',)

    order = Parameter(6.0, '1/rad', (0.1, 1e5), 'Base order, per turn of the motor.',
                      grid=(1.0, 2.0, 4.0, 6.0, 12.0, 24.0))
    cosine = Parameter((0.01,), 'N m', (-1e5, 1e5), 'Of each multiple.', off=0.0)
    sine = Parameter((0.0,), 'N m', (-1e5, 1e5), 'Of each multiple.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return wave(p.cosine, p.sine, p.order * motion.angle)
