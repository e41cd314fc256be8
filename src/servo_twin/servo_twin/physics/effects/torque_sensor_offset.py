"""A torque sensor whose zero is off."""

from ..effect import Parameter
from ..ports import Sensor


class TorqueSensorOffset(Sensor):
    r"""
    A constant in the reading.

    .. math:: y = x + y_0

    Holds while the bridge of the sensor is warm.
    """

    source = 'data sheets of torque sensors, zero error'
    sites = ('torque',)

    offset = Parameter(1.0, 'N m', (-1e6, 1e6), 'Reading at zero torque.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.value + p.offset
