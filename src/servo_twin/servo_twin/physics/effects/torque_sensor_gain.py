"""A torque sensor whose scale is off."""

from ..effect import Parameter
from ..ports import Sensor


class TorqueSensorGain(Sensor):
    r"""
    A share of the true value that the reading has too much.

    .. math:: y = (1 + g)\,x

    Holds within the linear range of the sensor.
    """

    source = 'data sheets of torque sensors, gain error'
    sites = ('torque',)

    excess = Parameter(0.02, '', (-0.9, 10.0), 'Share that it reads too much.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.value + p.excess * motion.value
