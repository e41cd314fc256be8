"""Torque constant that falls as the current saturates the iron."""

from ..effect import Parameter
from ..ports import Torque


class TorqueSaturation(Torque):
    r"""
    What large currents lack in torque.

    .. math:: \tau = -k\,\frac{i^2}{i^2 + i_0^2}\,i

    A cubic at small current that levels out to a smaller torque constant, where a cubic alone
    would turn the torque round. ``loss`` must stay below 8/9 of the torque constant, or more
    current would give less torque.
    """

    source = 'Hanselman: Brushless Permanent-Magnet Motor Design, 2003; the form is ours'
    sites = ('motor',)

    loss = Parameter(0.05, 'N m/A', (0.0, 1e5), 'Lost of the torque constant in the end.', off=0.0)
    knee = Parameter(3.0, 'A', (1e-6, 1e5), 'Current at which half of it is lost.',
                     grid=(1.0, 3.0, 10.0))

    @staticmethod
    def law(p, s, motion, h):
        square = motion.current * motion.current
        return -p.loss * motion.current * square / (square + p.knee * p.knee)
