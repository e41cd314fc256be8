"""A reading that passes a filter."""

from math import exp

from ..effect import Parameter
from ..ports import Sensor


class SensorLag(Sensor):
    r"""
    A filter of first order between the quantity and its reading.

    .. math:: t_r \dot y = x - y

    Begins settled. Exact where the quantity stands still between two samples.
    """

    source = 'Astrom, Wittenmark: Computer-Controlled Systems, 1997, ch. 2.3'
    sites = ('torque', 'current')
    memory = 2

    lag = Parameter(1e-3, 's', (0.0, 10.0), 'Time in which 63 % of a step shows.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        if s[1] == 0.0:
            s[0], s[1] = motion.value, 1.0
        if p.lag > 0.0:
            s[0] += (1.0 - exp(-h / p.lag)) * (motion.value - s[0])
        else:
            s[0] = motion.value
        return s[0]
