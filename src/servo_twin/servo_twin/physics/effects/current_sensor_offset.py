"""A current sensor whose zero is off."""

from ..effect import Parameter
from ..ports import Sensor


class CurrentSensorOffset(Sensor):
    r"""
    A constant in the reading.

    .. math:: y = x + y_0

    Holds while the amplifier of the sensor is warm.
    """

    source = 'data sheets of current sensors, zero error'
    sites = ('current',)

    offset = Parameter(0.02, 'A', (-1e6, 1e6), 'Reading at zero current.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.value + p.offset
