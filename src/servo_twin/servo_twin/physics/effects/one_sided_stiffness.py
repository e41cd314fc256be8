"""A transmission that is stiffer in one direction than in the other."""

from ..effect import Parameter
from ..ports import Mesh


class OneSidedStiffness(Mesh):
    r"""
    Half of what the stiffness differs by, beside the mechanism's linear one.

    .. math:: T = k_d\,|\varphi|

    A coupling whose claws bear on worn pads one way, or a belt whose strands are not alike.
    Conservative; below the linear stiffness in size. Holds for torsions that were measured. A
    diagnosis calls it a nonlinear stiffness.
    """

    source = 'data sheets of elastic couplings, torsional stiffness by direction'
    candidate = False

    difference = Parameter(100.0, 'N m/rad', (-1e12, 1e12),
                           'Stiffness gained where the motor is ahead, lost where it is behind.',
                           off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return p.difference * abs(motion.angle)
