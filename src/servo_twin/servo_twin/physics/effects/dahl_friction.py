"""Friction that builds up with travel after each reversal (Dahl)."""

from ..dahl_state import built_up
from ..effect import Parameter
from ..ports import Torque


class DahlFriction(Torque):
    r"""
    Dahl's friction with exponent one.

    .. math:: \frac{d\tau}{d\theta} = -\frac{\tau_c}{\theta_0}
              \left(1 + \frac{\tau}{\tau_c}\,\mathrm{sgn}(\omega)\right)

    Stepped by its closed form over the travel of a step, so exact while the shaft does not turn
    round within one. Independent of rate; has no static excess.
    """

    source = 'Dahl: Aerospace Corporation TOR-0158(3107-18)-1, 1968'
    candidate = False
    memory = 1

    level = Parameter(1.0, 'N m', (0.0, 1e5), 'What it tends to.', off=0.0)
    travel = Parameter(1e-3, 'rad', (1e-8, 10.0), 'Over which it builds up.',
                       grid=(1e-4, 1e-3, 1e-2))

    @staticmethod
    def law(p, s, motion, h):
        s[0] = built_up(s[0], h * motion.speed, p.travel)
        return -p.level * s[0]
