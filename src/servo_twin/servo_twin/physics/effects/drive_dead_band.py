"""A drive that does not answer small commands."""

from ..effect import Parameter
from ..ports import Drive


class DriveDeadBand(Drive):
    r"""
    Dead zone around zero.

    .. math:: u = u^* - \min(\max(u^*, -b), b)

    Holds for an output stage without current control in the band.
    """

    source = 'Khalil: Nonlinear Systems, 2002, sec. 1.2.7'
    sites = ('command',)

    half_width = Parameter(0.05, 'V', (0.0, 1e4), 'Smaller commands do nothing.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.value - min(max(motion.value, -p.half_width), p.half_width)
