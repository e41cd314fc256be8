"""A drive that does not answer small commands."""

from ..effect import Parameter
from ..ports import Drive


class DriveDeadBand(Drive):
    r"""
    What an output stage leaves out around zero, and how soon it is whole again beyond.

    .. math:: u = u^* - \min(\max(u^*, -b), b)\,
              \frac{r\,b}{r\,b + \max(0, |u^*| - b)}

    With a large ``r`` it is the dead zone of the textbooks, which lacks ``b`` in every larger
    command; with a small one a threshold, above which the command counts in full.
    """

    source = 'Khalil: Nonlinear Systems, 2002, sec. 1.2.7 for the dead zone; the return is ours'
    sites = ('command',)

    half_width = Parameter(0.05, 'V', (0.0, 1e4), 'Smaller commands do nothing.', off=0.0)
    regain = Parameter(1000.0, '', (1e-3, 1e6), 'Beyond the band, in half widths, until half of '
                       'the loss is made up.', grid=(0.1, 1.0, 10.0, 1000.0))

    @staticmethod
    def law(p, s, motion, h):
        lost = min(max(motion.value, -p.half_width), p.half_width)
        reach = p.regain * p.half_width
        beyond = max(0.0, abs(motion.value) - p.half_width)
        return motion.value - (lost * reach / (reach + beyond) if lost != 0.0 else 0.0)
