"""Friction in proportion to speed that fades as the machine warms up."""

from ..effect import Parameter
from ..elementary_functions import exp
from ..ports import Friction
from ..thinning import thinned


class ViscousDrift(Friction):
    r"""
    What cold grease adds to viscous friction: it fades with time, or follows a temperature.

    .. math:: \tau_f = \left(d_0\,e^{-t/t_0} + \frac{\kappa}{\beta}\left(1
              - e^{-\beta(\vartheta - \vartheta_0)}\right)\right) |\omega|

    Time counts from the start of the run. Grease thins exponentially with the temperature; without
    ``thinning`` (beta) the friction follows it in a straight line, as within some ten degrees of
    the reference. A diagnosis calls it a friction that drifts.
    """

    source = 'Simoni, Beschi, Legnani, Visioli: IROS 2015, friction with temperature effects'
    candidate = False

    excess = Parameter(1.0, 'N m s/rad', (-1e5, 1e5), 'At the start of the run.', off=0.0)
    settling = Parameter(300.0, 's', (0.1, 1e6), 'Time in which it falls to a third.',
                         grid=(10.0, 100.0, 1000.0))
    slope = Parameter(0.0, 'N m s/rad degC', (-1e4, 1e4), 'Rise with temperature.', off=0.0)
    reference = Parameter(20.0, 'degC', (-100.0, 300.0), 'Where the slope starts to count.')
    thinning = Parameter(0.0, '1/degC', (0.0, 1.0), 'Share by which the slope falls per degree.')

    @staticmethod
    def law(p, s, motion, h):
        fading = p.excess * exp(-motion.time / p.settling)
        warmth = p.slope * thinned(motion.temperature - p.reference, p.thinning)
        return (fading + warmth) * abs(motion.speed)
