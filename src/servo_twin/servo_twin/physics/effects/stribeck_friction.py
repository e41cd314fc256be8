"""Friction that falls from its static to its sliding level as the shaft starts to move."""

from ..effect import Parameter
from ..elementary_functions import exp
from ..ports import Friction


class StribeckFriction(Friction):
    r"""
    What a lubricated bearing resists with at low speed, above its Coulomb friction.

    .. math:: \tau_f = \tau_s\,e^{-|\omega/\omega_s|^\delta}

    The exponent is 2 after Armstrong-Helouvry, 1 in paper 001, from 0.5 to 1 after Bo and
    Pavelescu. Holds for steady sliding; presliding and the lag of friction behind speed need
    LuGre.
    """

    source = ('Armstrong-Helouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994; '
              'Bo, Pavelescu: Wear 82(3), 1982; paper 001 eq. 14')

    excess = Parameter(1.0, 'N m', (0.0, 1e5), 'Static above sliding level.', off=0.0)
    fade = Parameter(0.03, 'rad/s', (1e-5, 1e4), 'Speed at which the excess is gone.',
                     grid=(0.01, 0.03, 0.1, 0.3))
    exponent = Parameter(2.0, '', (0.2, 4.0), 'How abruptly it fades: 1 and less with a tail.',
                         grid=(2.0, 0.7))

    @staticmethod
    def law(p, s, motion, h):
        fast = motion.speed * (1.0 / p.fade)
        if p.exponent == 2.0:
            return p.excess * exp(-(fast * fast))
        return p.excess * exp(-(abs(fast) ** p.exponent))
