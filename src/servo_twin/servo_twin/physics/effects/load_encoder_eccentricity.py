"""A disc of the load encoder that is not centred on its shaft."""

from ..effect import Parameter
from ..elementary_functions import cos_sin
from ..ports import Sensor


class LoadEncoderEccentricity(Sensor):
    r"""
    First order of the turn of the load shaft, in the reading alone.

    .. math:: y = x + a \cos(E\theta_l) + b \sin(E\theta_l), \quad E = 1

    Holds for an offset that is small against the radius of the disc.
    """

    source = 'Heidenhain: Angle Encoders, section on eccentricity of the graduation'
    sites = ('load_position',)

    cosine = Parameter(1e-05, 'rad', (-0.5, 0.5), 'Amplitude of the cosine.', off=0.0)
    sine = Parameter(0.0, 'rad', (-0.5, 0.5), 'Amplitude of the sine.', off=0.0)
    order = Parameter(1.0, '1/rad', (0.01, 1e3), 'Periods in one turn of the shaft.',
                      told=False)

    @staticmethod
    def law(p, s, motion, h):
        cosine, sine = cos_sin(p.order * motion.angle)
        return motion.value + p.cosine * cosine + p.sine * sine
