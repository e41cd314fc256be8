"""What a drive makes of a command as any curve."""

from ..effect import Parameter
from ..ports import Drive
from ..spline import spline


class DriveOverCommand(Drive):
    r"""
    A spline over the size of the command, added to it.

    .. math:: u = u^* + \mathrm{sgn}(u^*) \sum_k c_k B_k(|u^*|)

    Beyond the largest command it stays as it is there.
    """

    source = 'Wood: Generalized Additive Models, 2017, sec. 5.3 (P-splines)'
    candidate = False
    sites = ('command',)

    low = Parameter(0.0, 'V', (-1e6, 1e6), 'Lowest command of the curve.')
    high = Parameter(10.0, 'V', (-1e6, 1e6), 'Highest command of the curve.')
    curve = Parameter((-0.1,), 'V', (-1e6, 1e6), 'Coefficients of the spline.',
                      off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        more = spline(p.curve, abs(motion.value), p.low, p.high)
        return motion.value + (more if motion.value > 0.0 else -more)
