"""A payload that hangs on the load by a spring of its own."""

from math import pi

from ..effect import Parameter
from ..ports import Torque


class PayloadResonance(Torque):
    r"""
    One more inertia with a spring and a damper.

    .. math:: J_p(\dot v + 2\zeta\omega_0 (v - \omega) + \omega_0^2 d) = 0, \quad
              \dot d = v - \omega, \quad \tau = -J_p\dot v

    d is the deflection of the payload against the load, v its speed, that of the load in the
    beginning. Semi-implicit Euler; stable while the step is below 2 / (its natural frequency on
    the load). Holds for small deflections.
    """

    source = 'Den Hartog: Mechanical Vibrations, 1956, sec. 3.2'
    sites = ('load',)
    memory = 3

    inertia = Parameter(0.5, 'kg m2', (0.0, 1e6), 'Of the payload.', off=0.0)
    frequency = Parameter(10.0, 'Hz', (0.01, 2e3), 'Natural frequency, load held fast.',
                          grid=(5.0, 10.0, 20.0, 40.0))
    damping = Parameter(0.02, '', (0.0, 10.0), 'Share of critical damping.', grid=(0.03,))

    @classmethod
    def hangs(cls, p):
        """Return the payload's inertia (kg m2) and its spring (N m/rad)."""
        natural = 2.0 * pi * p.frequency
        return (p.inertia, p.inertia * natural**2) if p.inertia > 0.0 else None

    @staticmethod
    def law(p, s, motion, h):
        if p.inertia == 0.0:
            s[0] = s[2] = 0.0
            return 0.0
        if s[2] == 0.0:
            s[1], s[2] = motion.speed, 1.0
        s[0] += h * (s[1] - motion.speed)  # both as the step before left them: no energy is made
        natural = 2.0 * pi * p.frequency
        spring, damper = natural * natural, 2.0 * p.damping * natural
        faster = -(spring * s[0] + damper * (s[1] - motion.speed)) / (1.0 + h * damper)
        s[1] += h * faster
        return -p.inertia * faster
