"""A supply that gives way under the current that a motor draws, as a battery does."""

from ..effect import Parameter
from ..ports import Drive


class SupplySag(Drive):
    r"""
    What a bridge loses of its volts where its supply has a resistance.

    .. math:: u = u^* - k\,u^{*2}\,i, \quad i = \frac{u^* - K_e \dot\theta_m}{R + k\,u^{*2}},
              \quad k = R_s / U^2

    The command is a share of the supply U, and the current of the supply is that share of the
    winding's. So its resistance R_s acts by the square of the share. Holds for a winding that
    settles within a step of the command; R and K_e are those of the motor.
    """

    source = 'Mohan, Undeland, Robbins: Power Electronics, 2003, sec. 7-7 (bridge)'
    sites = ('command',)

    drop = Parameter(1e-3, 'ohm/V2', (0.0, 1e3), 'Resistance of the supply over the square of its '
                     'voltage.', off=0.0)
    resistance = Parameter(1.0, 'ohm', (1e-6, 1e6), 'Of the winding.')
    back_emf = Parameter(0.1, 'V s/rad', (0.0, 1e4), 'Of the motor.')

    @staticmethod
    def law(p, s, motion, h):
        square = p.drop * motion.value * motion.value
        current = (motion.value - p.back_emf * motion.speed) / (p.resistance + square)
        return motion.value - square * current
