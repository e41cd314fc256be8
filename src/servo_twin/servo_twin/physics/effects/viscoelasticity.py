"""A transmission that creeps: a polymer belt, rubber, a spring that a damper gives way to."""

from ..effect import Parameter
from ..ports import Mesh


class Viscoelasticity(Mesh):
    r"""
    Maxwell element beside the spring of the transmission: a spring in series with a damper.

    .. math:: \dot T = k\,\dot\varphi - T / t_r

    In motions quicker than its time the transmission is stiffer by k; in slower ones it has a
    damper of k t_r more. By implicit Euler. A torsion that is held at the beginning has crept long
    ago. Holds for small changes of the torque.
    """

    source = 'Findley, Lai, Onaran: Creep and Relaxation of Viscoelastic Materials, 1976, ch. 5'
    memory = 1

    stiffness = Parameter(1e3, 'N m/rad', (0.0, 1e10), 'Beside the static one, at once.', off=0.0)
    time = Parameter(0.1, 's', (1e-6, 1e6), 'In which its torque fades to 37 %.')

    @staticmethod
    def law(p, s, motion, h):
        s[0] = (s[0] + h * p.stiffness * motion.rate) / (1.0 + h / p.time)
        return s[0]
