"""A brake, or a loss in a rotor, by currents that a field induces."""

from ..effect import Parameter
from ..ports import Friction


class EddyBrake(Friction):
    r"""
    It grows with speed up to a peak and falls beyond, as the currents push the field out.

    .. math:: \tau_f = \frac{2\,T x}{1 + x^2}, \quad x = \frac{|\omega|}{\omega_c}

    At rest there is none. Holds for a disc or drum whose field is constant.
    """

    source = 'Wouterse: IEE Proceedings B 138(4), 1991 (critical speed of eddy-current brakes)'

    peak = Parameter(0.1, 'N m', (0.0, 1e6), 'Torque at the critical speed.', off=0.0)
    speed = Parameter(10.0, 'rad/s', (1e-6, 1e6), 'The critical speed.',
                      grid=(1.0, 10.0, 100.0))

    @staticmethod
    def law(p, s, motion, h):
        share = abs(motion.speed) / p.speed
        return 2.0 * p.peak * share / (1.0 + share * share)
