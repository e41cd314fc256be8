"""A supply that gives way under the current that a motor draws, as a battery does."""

from ..effect import Parameter
from ..ports import Drive


class SupplySag(Drive):
    r"""
    What a bridge loses of its volts where its supply has a resistance.

    .. math:: u = u^* - k\,u^{*2}\,i - k_1\,u^* z, \quad t_1\,\dot z + z = u^* i,
              \quad i = \frac{u^* - k_1\,u^* z - K_e \dot\theta_m}{R + k\,u^{*2}},
              \quad k = R_s / U^2

    The command is a share of the supply U, and the current of the supply is that share of the
    winding's. So its resistance R_s acts by the square of the share. A battery has a second
    resistance that gives way within the time ``settling`` (``slow``, with a capacity beside it).
    Holds for a winding that settles within a step of the command; R and K_e are those of the
    motor.
    """

    source = ('Mohan, Undeland, Robbins: Power Electronics, 2003, sec. 7-7 (bridge); Plett: '
              'Battery Management Systems I, 2015, sec. 2.4 (two resistances and a capacity)')
    sites = ('command',)
    memory = 1

    drop = Parameter(1e-3, 'ohm/V2', (0.0, 1e3), 'Resistance of the supply over the square of its '
                     'voltage.', off=0.0)
    resistance = Parameter(1.0, 'ohm', (1e-6, 1e6), 'Of the winding.')
    slow = Parameter(0.0, 'ohm/V2', (0.0, 1e3), 'The same of what gives way slowly.', off=0.0)
    settling = Parameter(1.0, 's', (1e-3, 1e5), 'Time in which that gives way.',
                         grid=(0.3, 3.0, 30.0))
    back_emf = Parameter(0.1, 'V s/rad', (0.0, 1e4), 'Of the motor.')

    @staticmethod
    def law(p, s, motion, h):
        left = motion.value * (1.0 - p.slow * s[0])
        square = p.drop * motion.value * motion.value
        current = (left - p.back_emf * motion.speed) / (p.resistance + square)
        s[0] += h / (h + p.settling) * (motion.value * current - s[0])
        return left - square * current
