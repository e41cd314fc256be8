"""A drive that gives more for commands of one sign, as two half bridges that are not alike do."""

from ..effect import Parameter
from ..ports import Drive


class DriveAsymmetry(Drive):
    r"""
    What the sign of the command adds to it.

    .. math:: u = u^* + \tfrac{1}{2}\,d\,|u^*|

    The gain of the drive is the mean of both signs. A diagnosis calls it another gain.
    """

    source = 'the even part of a gain that differs by sign'
    sites = ('command',)
    candidate = False

    difference_by_sign = Parameter(
        0.02, '', (-2.0, 2.0), 'Gain of positive commands less that of negative ones, as a share '
        'of their mean.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.value + 0.5 * p.difference_by_sign * abs(motion.value)
