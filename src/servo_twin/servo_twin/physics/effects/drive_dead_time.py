"""A bridge that loses volts by the sign of its current, while neither of its switches is on."""

from ..effect import Parameter
from ..ports import Drive


class DriveDeadTime(Drive):
    r"""
    What the dead time of a bridge takes of the current of a winding.

    .. math:: i = i^* - \frac{h}{\tau + h}\,i_d\,\min(\max(i / i_r, -1), 1), \quad i_d = U_d / R

    The lost volts U_d are the share of a period that neither switch is on, of the supply. Up to
    the current i_r less is lost, since the parts of a bridge are charged first. Where i_r is 0, a
    current that fewer volts would drive does not flow. In a winding that settles with the time
    tau = L / R a step h takes a share of it: implicit Euler, as of the winding. A diagnosis calls
    it a dead band of the drive.
    """

    source = 'Jeong, Park: IEEE Trans. Ind. Electron. 38(2), 1991 (dead time of inverters)'
    sites = ('current',)
    candidate = False

    loss = Parameter(0.05, 'A', (0.0, 1e4), 'Lost volts over the resistance.', off=0.0)
    rounding = Parameter(0.0, 'A', (0.0, 1e4), 'Current from which all of it is lost.')
    settling = Parameter(0.0, 's', (0.0, 10.0), 'Inductance over resistance of the winding.')

    @staticmethod
    def law(p, s, motion, h):
        loss = p.loss * h / (p.settling + h)
        whole = loss + p.rounding
        share = loss / whole if whole > 0.0 else 0.0
        return motion.value - share * min(max(motion.value, -whole), whole)
