"""A spring whose force fades: air behind a throttle, rubber, oil."""

from ..effect import Parameter
from ..ports import Torque


class RelaxingSpring(Torque):
    r"""
    Maxwell element between load and frame: a spring in series with a damper.

    .. math:: \dot\tau = -k\,\omega_l - \tau / t_r

    A spring in motions quicker than its time, a damper of k t_r in slower ones. By implicit Euler.
    Holds for small changes of the force.
    """

    source = 'Findley, Lai, Onaran: Creep and Relaxation of Viscoelastic Materials, 1976, ch. 5'
    sites = ('load',)
    memory = 1

    stiffness = Parameter(10.0, 'N m/rad', (0.0, 1e9), 'Rise with the angle at once.', off=0.0)
    time = Parameter(0.3, 's', (1e-6, 1e6), 'In which the torque fades to 37 %.')

    @staticmethod
    def law(p, s, motion, h):
        s[0] = (s[0] - h * p.stiffness * motion.speed) / (1.0 + h / p.time)
        return s[0]
