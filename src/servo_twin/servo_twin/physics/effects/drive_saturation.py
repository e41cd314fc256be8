"""A drive that gives no more than it has."""

from ..effect import Parameter
from ..ports import Drive


class DriveSaturation(Drive):
    r"""
    Commands beyond a limit count less, or not at all.

    .. math:: u = u^* - \sigma\left(u^* - \min(\max(u^*, -l), l)\right)

    ``share`` 1 is a hard limit, less a gentle one, 0 none. Holds for a supply that does not sag.
    """

    source = 'paper 004 sec. II B; Khalil: Nonlinear Systems, 2002, sec. 1.2.7'
    sites = ('command',)

    share = Parameter(1.0, '', (0.0, 1.0), 'What is lost of a command beyond the limit.', off=0.0)
    limit = Parameter(10.0, 'V', (1e-6, 1e6), 'Smaller commands pass.',
                      grid=(0.5, 1.0, 2.0, 5.0, 10.0), required=True)

    @staticmethod
    def law(p, s, motion, h):
        beyond = motion.value - min(max(motion.value, -p.limit), p.limit)
        return motion.value - p.share * beyond
