"""A disc of the motor encoder that is not centred on its shaft."""

from math import cos, sin

from ..effect import Parameter
from ..ports import Sensor


class MotorEncoderEccentricity(Sensor):
    r"""
    First order of the turn of the motor shaft, in the reading alone.

    .. math:: y = x + a \cos(E\theta_m) + b \sin(E\theta_m), \quad E = 1

    Holds for an offset that is small against the radius of the disc.
    """

    source = 'Heidenhain: Angle Encoders, section on eccentricity of the graduation'
    candidate = False
    sites = ('motor_position',)

    cosine = Parameter(0.001, 'rad', (-0.5, 0.5), 'Amplitude of the cosine.', off=0.0)
    sine = Parameter(0.0, 'rad', (-0.5, 0.5), 'Amplitude of the sine.', off=0.0)
    order = Parameter(1.0, '1/rad', (0.01, 1e3), 'Periods in one turn of the shaft.')

    @staticmethod
    def law(p, s, motion, h):
        phase = p.order * motion.angle
        return motion.value + p.cosine * cos(phase) + p.sine * sin(phase)
