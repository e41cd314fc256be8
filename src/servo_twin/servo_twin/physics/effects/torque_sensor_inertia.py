"""A torque sensor with a part of the load's inertia between the transmission and itself."""

from ..effect import Parameter
from ..ports import Sensor


class TorqueSensorInertia(Sensor):
    r"""
    The reading lacks what a flange or a hub between it and the transmission takes.

    .. math:: y = x - J_f\,\dot\omega_l

    The inertia is a part of the load's: it changes the reading alone. The acceleration is that
    since the last reading. Holds where it changes little from one reading to the next.
    """

    source = 'manuals of torque transducers, inertia of the measuring side'
    sites = ('torque',)
    memory = 2

    inertia = Parameter(0.01, 'kg m2', (0.0, 1e6), 'In front of the sensor.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        if s[1] == 0.0:
            s[0], s[1] = motion.speed, 1.0
        acceleration = (motion.speed - s[0]) / h
        s[0] = motion.speed
        return motion.value - p.inertia * acceleration
