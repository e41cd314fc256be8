"""A winding that warms up: its resistance rises with the time."""

from ..effect import Parameter
from ..elementary_functions import exp
from ..ports import Drive


class WindingWarmth(Drive):
    r"""
    What the rise of its resistance takes from the volts of a winding.

    .. math:: u = u^* - \frac{\Delta R}{k}\,i, \quad
              i = \frac{k\,u^* - K_e \dot\theta_m}{R + \Delta R}, \quad
              \Delta R = r\,(1 - e^{-t/t_0})

    Time counts from the start of the run, when the winding is as warm as that of the file. Holds
    for steady use, and for a winding that settles within a step of the command; R and K_e are
    those of the motor, k is the gain of the drive. Copper gains 0.39 % a degree.
    """

    source = 'Krishnan: Permanent Magnet Synchronous and Brushless DC Motor Drives, 2010'
    sites = ('command',)
    candidate = False

    rise = Parameter(0.1, 'ohm', (-1e6, 1e6), 'By which the resistance is larger in the end.',
                     off=0.0)
    settling = Parameter(100.0, 's', (0.1, 1e6), 'Time in which two thirds of that are reached.',
                         grid=(10.0, 100.0, 1000.0))
    resistance = Parameter(1.0, 'ohm', (1e-6, 1e6), 'Of the winding at the start.')
    back_emf = Parameter(0.1, 'V s/rad', (0.0, 1e4), 'Of the motor.')
    gain = Parameter(1.0, 'V/V', (-1e4, 1e4), 'Of the drive.')

    @staticmethod
    def law(p, s, motion, h):
        if p.gain == 0.0:
            return motion.value  # no volts, no current
        more = p.rise * (1.0 - exp(-motion.time / p.settling))
        current = (p.gain * motion.value - p.back_emf * motion.speed) / max(
            p.resistance + more, 1e-6)
        return motion.value - more * current / p.gain
