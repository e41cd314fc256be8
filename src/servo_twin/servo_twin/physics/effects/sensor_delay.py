"""A reading that is late."""

from ..delay_line import delayed, ROOM
from ..effect import Parameter
from ..ports import Sensor


class SensorDelay(Sensor):
    r"""
    A constant time between the quantity and its reading.

    .. math:: y(t) = x(t - t_d)

    Need not be a multiple of the sample period: what lies between two samples is a straight line.
    Before the start of the run the reading is taken to have stood at its first value. Holds for
    signals that change little within a sample.
    """

    source = 'Astrom, Wittenmark: Computer-Controlled Systems, 1997, ch. 2.3'
    memory = ROOM

    delay = Parameter(1e-3, 's', (0.0, 1.0), 'Age of a reading.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return delayed(s, motion.value, p.delay, h)
