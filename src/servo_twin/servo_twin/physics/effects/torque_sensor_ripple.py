"""Torque that a sensor reads by the place of its shaft: cross-talk, or a wheel that bends it."""

from ..effect import Parameter
from ..harmonics import wave
from ..ports import Sensor


class TorqueSensorRipple(Sensor):
    r"""
    A base order of the load turn and its multiples, in the reading alone.

    .. math:: y = x + \sum_{i=1}^n a_i \cos(i E \theta_l) + b_i \sin(i E \theta_l)

    A sensor in a harmonic drive reads how this bends, twice in a turn of the motor.
    Holds while what is read besides does not grow with the torque.
    """

    source = ('Taghirad, Helmy, Belanger, Intelligent built-in torque sensor for harmonic drive '
              'systems, DOI 10.1109/19.728840')
    sites = ('torque',)
    candidate = False

    order = Parameter(1.0, '1/rad', (0.1, 1e5), 'Base order, per turn of the load.',
                      grid=(1.0, 2.0, 40.0))
    cosine = Parameter((0.1,), 'N m', (-1e6, 1e6), 'Of each multiple.', off=0.0)
    sine = Parameter((0.0,), 'N m', (-1e6, 1e6), 'Of each multiple.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.value + wave(p.cosine, p.sine, p.order * motion.angle)
