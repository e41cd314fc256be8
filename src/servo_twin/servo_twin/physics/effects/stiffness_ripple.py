"""A stiffness that varies over the turn of the load."""

from ..effect import Parameter
from ..harmonics import wave
from ..ports import Mesh


class StiffnessRipple(Mesh):
    r"""
    A base order of the turn of the load and its multiples, in proportion to the torsion.

    .. math:: T = \varphi \sum_{i=1}^n a_i \cos(i E\theta_l) + b_i \sin(i E\theta_l)

    As many teeth carry as are in contact. The sum must stay below the linear stiffness. Holds for
    small torsions: what the slope of the stiffness gives back to the shaft is of their square.
    A diagnosis calls it an error of the stiffness.
    """

    source = 'Kahraman, Singh: J. Sound Vib. 146(1), 1991 (stiffness of the mesh over the turn)'
    candidate = False

    order = Parameter(30.0, '1/rad', (0.01, 1e5), 'Base order, per turn of the load.',
                      grid=(1.0, 2.0, 30.0))
    cosine = Parameter((1e3,), 'N m/rad', (-1e9, 1e9), 'Of each multiple.', off=0.0)
    sine = Parameter((0.0,), 'N m/rad', (-1e9, 1e9), 'Of each multiple.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return motion.angle * wave(p.cosine, p.sine, p.order * motion.load_angle)
