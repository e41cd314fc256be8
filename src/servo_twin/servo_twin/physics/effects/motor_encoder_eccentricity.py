"""A disc or resolver of the motor encoder that is not centred on its shaft, or not round."""

from ..effect import Parameter
from ..harmonics import wave
from ..ports import Sensor


class MotorEncoderEccentricity(Sensor):
    r"""
    A base order of the turn of the motor shaft and its multiples, in the reading alone.

    .. math:: y = x + \sum_{i=1}^n a_i \cos(i E \theta_m) + b_i \sin(i E \theta_m)

    A resolver of p pole pairs errs at orders p and 2 p. What interpolates between lines errs at
    their number. Holds for an offset that is small against the radius of the disc.
    """

    source = 'Heidenhain: Angle Encoders, section on eccentricity of the graduation'
    sites = ('motor_position',)
    candidate = False

    order = Parameter(1.0, '1/rad', (0.01, 1e5), 'Base order, per turn of the motor.',
                      grid=(1.0, 2.0, 40.0))
    cosine = Parameter((1e-3,), 'rad', (-0.5, 0.5), 'Of each multiple.', off=0.0)
    sine = Parameter((0.0,), 'rad', (-0.5, 0.5), 'Of each multiple.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.value + wave(p.cosine, p.sine, p.order * motion.angle)
