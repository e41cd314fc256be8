"""A disc brake that was asked for a torque."""

from ..effect import Parameter
from ..elementary_functions import cos_sin, exp
from ..ports import Friction


class DiscBrake(Friction):
    r"""
    Dry friction of a disc that is pressed with a set force.

    .. math:: \tau_f = \tau_a\left(1 + g + a\cos\theta + b\sin\theta
              + s\,e^{-(\omega/\omega_s)^2}\right)

    ``asked`` is set, not found; the rest is what a brake makes of it. Holds while the force is
    kept: how its control oscillates is left out. No candidate of a diagnosis: a machine has a
    brake or it has none, and what is wrong with one is friction under other names.
    """

    source = 'paper 002, bench: resistive torque by a brake whose mean is what was asked'
    candidate = False
    sites = ('motor', 'load')

    asked = Parameter(1.0, 'N m', (0.0, 1e5), 'What the brake is set to.', off=0.0)
    gain = Parameter(0.0, '', (-1.0, 10.0), 'Relative error of the mean.')
    cosine = Parameter(0.0, '', (-1.0, 1.0), 'Relative, over the turn of the disc.')
    sine = Parameter(0.0, '', (-1.0, 1.0), 'Relative, over the turn of the disc.')
    grip = Parameter(0.0, '', (0.0, 10.0), 'Relative excess of a disc at rest.')
    fade = Parameter(1.0, 'rad/s', (1e-5, 1e4), 'Speed at which the excess is gone.')

    @staticmethod
    def law(p, s, motion, h):
        cosine, sine = cos_sin(motion.angle)
        level = 1.0 + p.gain + p.cosine * cosine + p.sine * sine
        return p.asked * (level + p.grip * exp(-((motion.speed * (1.0 / p.fade)) ** 2)))
