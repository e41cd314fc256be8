"""A command that arrives late."""

from ..delay_line import delayed, ROOM
from ..effect import Parameter
from ..ports import Drive


class CommandDelay(Drive):
    r"""
    A constant dead time of bus and drive.

    .. math:: u(t) = u^*(t - t_d)

    Need not be a multiple of the step: what lies between two steps is a straight line. Before the
    start of the run the command is taken to have stood at its first value. Holds where the delay
    is constant; jitter is not modelled.
    """

    source = 'Astrom, Wittenmark: Computer-Controlled Systems, 1997, ch. 2.3'
    sites = ('command',)
    memory = ROOM

    delay = Parameter(1e-3, 's', (0.0, 1.0), 'From sending to acting.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return delayed(s, motion.value, p.delay, h)
