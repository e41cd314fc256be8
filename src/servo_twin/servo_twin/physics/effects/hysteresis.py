"""A transmission whose torque depends on where the torsion last turned round."""

from ..effect import Parameter
from ..maxwell_slip import slipped
from ..ports import Mesh


class Hysteresis(Mesh):
    r"""
    Four Maxwell-slip elements side by side, which slip one after the other.

    .. math:: T = \frac{\tau_h}{4} \sum_{i=1}^4 \frac{z_i}{d_i}, \quad
              d_i = \frac{i}{4} d, \quad
              z_i \leftarrow \min(\max(z_i + \Delta\varphi, -d_i), d_i)

    Independent of rate, with closed minor loops (Masing); relaxed at zero torsion in the
    beginning. Holds while creep of the material does not matter.
    """

    source = ('Iwan: J. Appl. Mech. 33(4), 1966; '
              'Al-Bender, Lampaert, Swevers: IEEE TAC 50(11), 2005')
    memory = 5

    level = Parameter(5.0, 'N m', (0.0, 1e5), 'Half the height of a wide loop.', off=0.0)
    travel = Parameter(1e-4, 'rad', (1e-9, 10.0), 'Torsion by which all elements slip.',
                       grid=(3e-5, 1e-4, 3e-4))

    @staticmethod
    def law(p, s, motion, h):
        moved = motion.angle - s[4]
        s[4] = motion.angle
        return 0.25 * p.level * slipped(s, moved, p.travel)
