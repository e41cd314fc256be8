"""Friction in proportion to speed that fades as the machine warms up."""

from ..effect import Parameter
from ..elementary_functions import exp
from ..ports import Friction


class ViscousDrift(Friction):
    r"""
    What cold grease adds to viscous friction: it fades with time, or follows a temperature.

    .. math:: \tau_f = \left(d_0\,e^{-t/t_0} + \kappa\,(\vartheta - \vartheta_0)\right) |\omega|

    Time counts from the start of the run. Holds for steady use and within some ten degrees of the
    reference; the viscosity of grease itself is exponential in temperature. A diagnosis calls it a
    friction that drifts.
    """

    source = 'Simoni, Beschi, Legnani, Visioli: IROS 2015, friction with temperature effects'
    candidate = False

    excess = Parameter(1.0, 'N m s/rad', (-1e5, 1e5), 'At the start of the run.', off=0.0)
    settling = Parameter(300.0, 's', (0.1, 1e6), 'Time in which it falls to a third.',
                         grid=(10.0, 100.0, 1000.0))
    slope = Parameter(0.0, 'N m s/rad degC', (-1e4, 1e4), 'Rise with temperature.', off=0.0)
    reference = Parameter(20.0, 'degC', (-100.0, 300.0), 'Where the slope starts to count.')

    @staticmethod
    def law(p, s, motion, h):
        fading = p.excess * exp(-motion.time / p.settling)
        return (fading + p.slope * (motion.temperature - p.reference)) * abs(motion.speed)
