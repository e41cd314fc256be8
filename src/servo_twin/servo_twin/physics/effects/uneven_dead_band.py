"""A drive that leaves small commands out, of one sign more than of the other."""

from ..effect import Parameter
from ..ports import Drive


class UnevenDeadBand(Drive):
    r"""
    What the overlap of a valve leaves out, which is seldom the same both ways.

    .. math:: u = u^* - \min(\max(u^*, -b_-), b_+)

    A diagnosis calls it `drive_dead_band`.
    """

    source = 'Merritt: Hydraulic Control Systems, 1967, sec. 5.4 (overlapped spools)'
    candidate = False
    sites = ('command',)

    positive = Parameter(0.05, 'V', (0.0, 1e4), 'Smaller positive commands do nothing.', off=0.0)
    negative = Parameter(0.05, 'V', (0.0, 1e4), 'Smaller negative commands do nothing.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.value - min(max(motion.value, -p.negative), p.positive)
