"""Presliding friction: contacts that deflect before they slip (LuGre)."""

from ..effect import Parameter
from ..elementary_functions import exp
from ..ports import Torque


class PreslidingFriction(Torque):
    r"""
    LuGre friction without its viscous part.

    .. math::
        \dot z = \omega - \frac{\sigma_0 |\omega|}{g(\omega)} z, \quad
        g = \tau_c + \tau_s e^{-(\omega/\omega_s)^2}, \quad
        \tau = -\sigma_0 (z + t_1 \dot z), \quad
        \sigma_0 = \frac{\tau_c + \tau_s}{z_0}

    The deflection z goes by implicit Euler and never overshoots. The shaft is pushed explicitly:
    with its inertia J the step h must keep :math:`h^2 \sigma_0` and :math:`h\,t_1 \sigma_0` below
    J. Where ``excess`` and ``lag`` are both large the damping of the contacts may give back energy
    while friction falls.
    """

    source = 'Canudas de Wit, Olsson, Astrom, Lischinsky: IEEE TAC 40(3), 1995, eq. 1 to 4'
    leaves = ('excess',)  # to stribeck_friction, or presliding would be named for it
    memory = 1

    level = Parameter(1.0, 'N m', (0.0, 1e5), 'Sliding level.', off=0.0)
    excess = Parameter(0.0, 'N m', (0.0, 1e5), 'Static above sliding level.', off=0.0)
    breakaway = Parameter(1e-3, 'rad', (1e-8, 10.0), 'Deflection at which contacts slip.',
                          grid=(1e-4, 1e-3, 1e-2))
    fade = Parameter(0.03, 'rad/s', (1e-5, 1e4), 'Speed at which the excess is gone.')
    lag = Parameter(1e-4, 's', (0.0, 1.0), 'Damping of the contacts over their stiffness.')

    @staticmethod
    def law(p, s, motion, h):
        most = p.level + p.excess
        if most <= 0.0 or h <= 0.0:
            s[0] = 0.0
            return 0.0
        fade = motion.speed / p.fade
        slipping = (p.level + p.excess * exp(-fade * fade)) / most * p.breakaway
        before = s[0]
        slipping = max(slipping, 1e-6 * p.breakaway)
        s[0] = (before + h * motion.speed) / (1.0 + h * abs(motion.speed) / slipping)
        return -most / p.breakaway * (s[0] + p.lag * (s[0] - before) / h)
