"""Torque constant that falls as the current saturates the iron."""

from math import sqrt

from ..effect import Parameter
from ..ports import Torque


class TorqueSaturation(Torque):
    r"""
    What large currents lack in torque.

    .. math:: \tau = -k\left(1 - \frac{1}{\sqrt{1 + (i/i_0)^2}}\right) i

    A cubic at small current; at large current the torque constant is smaller by ``loss``, where a
    cubic alone would turn the torque round. With the whole torque constant as ``loss`` the torque
    levels off; it must not be more, or more current would give less torque.
    """

    source = 'Hanselman: Brushless Permanent-Magnet Motor Design, 2003; the form is ours'
    sites = ('motor',)

    loss = Parameter(0.05, 'N m/A', (0.0, 1e5), 'Lost of the torque constant in the end.', off=0.0)
    knee = Parameter(3.0, 'A', (1e-6, 1e5), 'Current from which much of it is lost.',
                     grid=(1.0, 3.0, 10.0))

    @staticmethod
    def law(p, s, motion, h):
        beyond = motion.current / p.knee
        return -p.loss * motion.current * (1.0 - 1.0 / sqrt(1.0 + beyond * beyond))
