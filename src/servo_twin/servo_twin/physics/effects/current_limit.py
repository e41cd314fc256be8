"""A chopper that lets no more current into the winding than its limit."""

from ..effect import Parameter
from ..ports import Drive


class CurrentLimit(Drive):
    r"""
    What the command would drive beyond a limit does not flow.

    .. math:: i = i^* - \sigma\left(i^* - \min(\max(i^*, -i_l), i_l)\right)

    ``share`` 1 is a hard limit, less a gentle one, 0 none. Holds while the winding settles within
    a step. A diagnosis calls it a saturation of the drive.
    """

    source = 'Leonhard: Control of Electrical Drives, 2001, limits of the current'
    sites = ('current',)
    candidate = False

    share = Parameter(1.0, '', (0.0, 1.0), 'What is lost of a current beyond the limit.', off=0.0)
    limit = Parameter(1.0, 'A', (1e-6, 1e5), 'Smaller currents pass.', required=True)

    @staticmethod
    def law(p, s, motion, h):
        beyond = motion.value - min(max(motion.value, -p.limit), p.limit)
        return motion.value - p.share * beyond
