"""Angle that the shape of the teeth adds and takes as they pass."""

from ..effect import Parameter
from ..elementary_functions import cos_sin
from ..ports import MeshError


class TransmissionError(MeshError):
    r"""
    A base order of the load turn and its multiples, different in each direction.

    .. math:: \theta_e = \sum_{i=1}^n a_i \cos(i E \theta_l) + b_i \sin(i E \theta_l)

    Paper 000 writes amplitude and phase; cosine and sine amplitudes say the same and are linear.
    Harmonics come from one sine and one cosine by adding angles. Where forward and reverse
    differ, one fades into the other over ``blend`` of travel after a reversal, as the load passes
    to the other flank. Holds while the deformed teeth touch as the unloaded ones do.
    """

    source = 'paper 000 eq. 12'

    order = Parameter(40.0, '1/rad', (0.1, 1e5), 'Base order, per turn of the load.',
                      grid=(1.0, 2.0, 40.0))
    cosine = Parameter((1e-5,), 'rad', (-0.1, 0.1), 'Of each multiple, forward.', off=0.0)
    sine = Parameter((0.0,), 'rad', (-0.1, 0.1), 'Of each multiple, forward.', off=0.0)
    cosine_change = Parameter((0.0,), 'rad', (-0.1, 0.1), 'Reverse less forward.', off=0.0)
    sine_change = Parameter((0.0,), 'rad', (-0.1, 0.1), 'Reverse less forward.', off=0.0)
    blend = Parameter(1e-3, 'rad', (1e-7, 10.0), 'Travel over which the direction takes over.')

    @staticmethod
    def law(p, s, motion, h):
        backwards = min(1.0, motion.travel * (1.0 / p.blend))
        if motion.direction > 0.0:
            backwards = 1.0 - backwards
        once_cos, once_sin = cos_sin(p.order * motion.load_angle)
        c, z, total = once_cos, once_sin, 0.0
        for i in range(len(p.cosine)):
            total += (p.cosine[i] + backwards * p.cosine_change[i]) * c
            total += (p.sine[i] + backwards * p.sine_change[i]) * z
            c, z = c * once_cos - z * once_sin, z * once_cos + c * once_sin
        return total
