"""A transmission whose loops are rounded: its torque bends over after each reversal (Dahl)."""

from ..dahl_state import built_up
from ..effect import Parameter
from ..ports import Mesh


class DahlHysteresis(Mesh):
    r"""
    Dahl's friction in the torsion, beside the spring of the transmission.

    .. math:: T = \tau_h\,z, \quad
              \frac{dz}{d\varphi} = \frac{1 - z\,\mathrm{sgn}(\dot\varphi)}{\varphi_h}

    Independent of rate. Its minor loops do not close but wander, as those of Bouc and Wen do, of
    which it is the one with exponent one; those of :class:`~.hysteresis.Hysteresis` close.
    Relaxed at zero torsion in the beginning.
    """

    source = ('Dahl: Aerospace Corporation TOR-0158(3107-18)-1, 1968; '
              'Wen: J. Eng. Mech. Div. 102(2), 1976')
    candidate = False
    memory = 2

    level = Parameter(1.0, 'N m', (0.0, 1e5), 'Half the height of a wide loop.', off=0.0)
    travel = Parameter(1e-4, 'rad', (1e-9, 10.0), 'Torsion over which it builds up.')

    @staticmethod
    def law(p, s, motion, h):
        s[0] = built_up(s[0], motion.angle - s[1], p.travel)
        s[1] = motion.angle
        return p.level * s[0]
