"""A drive that can put no more than so much power back while the motor brakes."""

from ..effect import Parameter
from ..ports import Drive


class BrakingPowerLimit(Drive):
    r"""
    A command of current is cut while the motor brakes, the more the faster it turns.

    .. math:: |u| \le p / |\omega_m| \quad\text{while}\quad u^*\,\omega_m < 0

    ``power`` is in the unit of the command times rad/s: times gain and torque constant it is in W.
    A supply that takes nothing back, or a braking resistor, has such a limit. ``share`` 1 is a
    hard limit, 0 none. Holds for a bus whose voltage stays as it is.
    """

    source = 'Mohan: Electric Drives, 2003, sec. 4.6 (braking), as a limit of power'
    sites = ('command',)

    share = Parameter(1.0, '', (0.0, 1.0), 'What is lost of a command beyond the limit.', off=0.0)
    power = Parameter(1000.0, 'V rad/s', (1e-9, 1e12), 'Command times speed that is let through.',
                      required=True)

    @staticmethod
    def law(p, s, motion, h):
        if motion.value * motion.speed >= 0.0:
            return motion.value
        beyond = max(abs(motion.value) - p.power / abs(motion.speed), 0.0)
        return motion.value - p.share * (beyond if motion.value > 0.0 else -beyond)
