"""Lost motion where no torque is told: the load waits while the motor passes the gap."""

from ..effect import Parameter
from ..ports import MeshError


class LostMotion(MeshError):
    r"""
    Play: the load stays while the motor passes the gap, and follows at either end of it.

    .. math:: z \leftarrow \min\left(\max\left(z + \frac{\Delta\theta_m}{N}, -b\right), b\right),
              \quad \theta_e = z, \quad 2b = \text{width}

    The motor's travel alone decides, and not the torque. So it holds where friction of the load is
    larger than all else that acts on it, and in a rigid transmission. In the middle of the gap at
    the start. Where the transmitted torque is known, `backlash` is the law of a gap.
    """

    source = 'Nordin, Gutman: Automatica 38(10), 2002, the input-output model of a backlash'
    candidate = False
    memory = 3

    width = Parameter(1e-3, 'rad', (0.0, 1.0), 'From one end to the other.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        if s[2] == 0.0:
            s[1], s[2] = motion.driven, 1.0
        half = 0.5 * p.width
        s[0] = min(max(s[0] + motion.driven - s[1], -half), half)
        s[1] = motion.driven
        return s[0]
