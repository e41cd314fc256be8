"""Torque constant that falls with speed and as the magnets warm up."""

from ..effect import Parameter
from ..ports import Torque


class TorqueConstantChange(Torque):
    r"""
    What speed and temperature add to the torque of a current.

    .. math:: \tau = \left(\kappa\,(\vartheta - \vartheta_0) - b\,\omega^2\right) i

    Magnets lose a few per mille a degree. A current that is late by T_d against the field of a
    machine of p pole pairs has a torque smaller by half the square of p T_d omega, and a field
    that is weakened looks alike. Holds while both are small.
    """

    source = 'Krishnan: Permanent Magnet Synchronous and Brushless DC Motor Drives, 2010'
    sites = ('motor',)
    candidate = False

    by_temperature = Parameter(-1e-4, 'N m/A/degC', (-1e3, 1e3), 'Rise with temperature.',
                               off=0.0)
    reference = Parameter(20.0, 'degC', (-100.0, 300.0),
                          'Where the torque constant of the drive holds.')
    by_speed = Parameter(1e-8, 'N m s2/rad2/A', (-1e3, 1e3),
                         'Fall with the square of the speed of the motor.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        warm = p.by_temperature * (motion.temperature - p.reference)
        return motion.current * (warm - p.by_speed * motion.speed * motion.speed)
