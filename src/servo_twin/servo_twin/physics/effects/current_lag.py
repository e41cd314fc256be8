"""A current loop of finite bandwidth."""

from ..effect import Parameter
from ..ports import Drive


class CurrentLag(Drive):
    r"""
    First-order lag of the current behind what the drive makes of the command.

    .. math:: t_i\,\dot i + i = i^*

    By implicit Euler. Holds below the bandwidth of the current loop's own filters.
    """

    source = 'Leonhard: Control of Electrical Drives, 2001, current loop as a first-order lag'
    sites = ('current',)
    memory = 1

    lag = Parameter(1e-3, 's', (0.0, 10.0), 'Time constant.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        if p.lag <= 0.0:
            s[0] = motion.value
        else:
            s[0] += h / (h + p.lag) * (motion.value - s[0])
        return s[0]
