"""Current that a current loop loses to the back EMF while the motor accelerates."""

from ..effect import Parameter
from ..ports import Drive


class BackEmfDroop(Drive):
    r"""
    A PI current loop that cancels the pole of the winding, disturbed by the back EMF.

    .. math:: \Delta i = -\frac{\kappa\,s}{(t_e s + 1)(t_c s + 1)}\,\omega_m, \quad
              \kappa = \frac{k_e\,t_c}{R}, \quad t_e = \frac{L}{R}

    A steady back EMF is integrated away; one that ramps leaves a lasting error. Both lags by
    implicit Euler. Holds while the supply does not limit the voltage; how the loop follows its
    reference is `current_lag`.
    """

    source = 'Leonhard: Control of Electrical Drives, 2001, current control with back EMF'
    sites = ('current',)
    candidate = False
    memory = 2

    droop = Parameter(1e-4, 'A s2/rad', (0.0, 1e3), 'Current lost for 1 rad/s2 of the motor.',
                      off=0.0)
    electrical = Parameter(3e-3, 's', (0.0, 10.0), 'Time constant of the winding, t_e.')
    closed = Parameter(3e-4, 's', (0.0, 10.0), 'Time constant of the closed loop, t_c.')

    @staticmethod
    def law(p, s, motion, h):
        if h > 0.0:
            before = s[0]
            s[0] += h / (h + p.electrical) * (motion.speed - s[0])
            s[1] += h / (h + p.closed) * ((s[0] - before) / h - s[1])
        return motion.value - p.droop * s[1]
