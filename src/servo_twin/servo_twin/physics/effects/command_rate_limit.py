"""A drive that follows its command no faster than a limit."""

from ..effect import Parameter
from ..ports import Drive


class CommandRateLimit(Drive):
    r"""
    The command that acts changes by no more than a rate; what is slower passes as it is.

    .. math:: u = u^* - \sigma (u^* - v), \quad \dot v = \min(\max((u^* - v) / h, -r), r)

    ``share`` 1 is a hard limit, 0 none. Holds where the limit is the same up and down.
    """

    source = 'Astrom, Murray: Feedback Systems, 2008, sec. 9.5 (rate limited actuators)'
    sites = ('command',)
    memory = 2

    share = Parameter(1.0, '', (0.0, 1.0), 'What is lost of a change beyond the limit.', off=0.0)
    rate = Parameter(1.0, 'V/s', (1e-6, 1e9), 'Slower changes pass.', required=True)

    @staticmethod
    def law(p, s, motion, h):
        if s[1] == 0.0:
            s[0], s[1] = motion.value, 1.0
        most = h * p.rate
        s[0] += min(max(motion.value - s[0], -most), most)
        return motion.value - p.share * (motion.value - s[0])
