"""A drive that runs out of voltage: the faster the motor, the less current it can drive."""

from ..effect import Parameter
from ..ports import Drive


class TorqueSpeedLimit(Drive):
    r"""
    A command of current is cut at a limit that falls with the speed while the motor drives.

    .. math:: |u| \le \max\bigl(l - d\,\omega_m \,\mathrm{sgn}\,u^*,\ 0\bigr)

    The supply over the resistance gives ``limit``, the back EMF over the resistance ``slope``.
    Braking finds more. ``share`` 1 is a hard limit, 0 none. Holds for a supply that does not sag.
    A limit that falls so steeply that it damps the motor within a step is refused with the file.
    """

    source = 'Pillay, Krishnan: IEEE Trans. Ind. Appl. 25(2), 1989 (voltage limit of a drive)'
    sites = ('command',)

    share = Parameter(1.0, '', (0.0, 1.0), 'What is lost of a command beyond the limit.', off=0.0)
    limit = Parameter(10.0, 'V', (1e-6, 1e6), 'The limit at standstill.', required=True)
    slope = Parameter(0.1, 'V s/rad', (0.0, 1e6), 'How it falls with the speed.', required=True)

    @staticmethod
    def law(p, s, motion, h):
        if motion.value == 0.0:
            return motion.value
        way = 1.0 if motion.value > 0.0 else -1.0
        most = max(p.limit - p.slope * way * motion.speed, 0.0)
        beyond = max(way * motion.value - most, 0.0)
        return motion.value - p.share * way * beyond
