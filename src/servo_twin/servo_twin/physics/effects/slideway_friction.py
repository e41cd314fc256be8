"""Friction of a table on its ways, under its weight and the cutting force that presses it."""

from ..effect import Parameter
from ..elementary_functions import exp
from ..ports import Friction


class SlidewayFriction(Friction):
    r"""
    Coulomb friction of what presses the ways, viscous friction, and the excess of a slow table.

    .. math:: F_f = \mu (W + F_z) + \mu_v |\dot S| + f_s\,e^{-b_0 |\dot S|}

    with W the weight of the table, M g. A way that slides is in m and N here, as all at the load
    of a linear axis. The paper writes the exponent without the bars, which would grow without
    bounds one way. Holds for steady sliding. No candidate of a diagnosis: it is the sum of three
    that are.
    """

    source = 'paper 001 eq. 14'
    candidate = False

    coefficient = Parameter(0.02, '', (0.0, 10.0), 'Of Coulomb friction, mu.', off=0.0)
    weight = Parameter(50.0, 'N m', (0.0, 1e7), 'Of the table, M g.')
    pressing = Parameter(0.0, 'N m', (-1e7, 1e7), 'Cutting force that presses the table, F_z.')
    slope = Parameter(1.0, 'N m s/rad', (0.0, 1e6), 'Viscous friction, mu_v.', off=0.0)
    excess = Parameter(0.5, 'N m', (0.0, 1e6), 'Of a table that just moves, f_s.', off=0.0)
    decay = Parameter(30.0, 's/rad', (0.0, 1e6), 'How fast that falls with speed, b_0.')

    @staticmethod
    def law(p, s, motion, h):
        speed = abs(motion.speed)
        return (p.coefficient * (p.weight + p.pressing) + p.slope * speed
                + p.excess * exp(-p.decay * speed))
