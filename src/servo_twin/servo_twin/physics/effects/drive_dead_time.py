"""A bridge that loses volts by the sign of its current, while neither of its switches is on."""

from ..effect import Parameter
from ..ports import Drive


class DriveDeadTime(Drive):
    r"""
    What the dead time of a bridge takes of the current of a winding.

    .. math:: i = i^* - \min(\max(i^*, -i_d), i_d), \quad i_d = U_d / R

    The lost volts U_d are the share of a period that neither switch is on, of the supply. A
    current that fewer volts would drive does not flow. Holds while the winding settles within a
    step. A diagnosis calls it a dead band of the drive.
    """

    source = 'Jeong, Park: IEEE Trans. Ind. Electron. 38(2), 1991 (dead time of inverters)'
    sites = ('current',)
    candidate = False

    loss = Parameter(0.05, 'A', (0.0, 1e4), 'Lost volts over the resistance.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.value - min(max(motion.value, -p.loss), p.loss)
