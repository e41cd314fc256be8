"""Inertia that depends on where another axis stands, as that of a pan on its tilt."""

from ..effect import Parameter
from ..elementary_functions import cos_sin
from ..ports import Inertia


class CoupledInertia(Inertia):
    r"""
    A rigid body on an axis square to this one.

    .. math:: J(\epsilon) = J_+ + J_c \cos E\epsilon + J_s \sin E\epsilon, \quad E = 2, \quad
              J_+ = \sqrt{J_c^2 + J_s^2} + J_0

    The inertia of a rigid body about a fixed axis has no other orders of the angle by which it is
    turned, whatever its shape. It is never below J_0, so that no values make it negative. The
    angle is the recorded `coupled_position`. What the turning axis does to the other one is left
    to the other one's servo file. No candidate of a diagnosis: most machines record no other axis.
    """

    source = ('paper 004 sec. II A (azimuth inertia over elevation); '
              'Goldstein, Classical Mechanics, 2002, sec. 5.3 for the law')
    candidate = False

    level = Parameter(0.0, 'kg m2', (0.0, 1e6), 'Least of it, J_0.', off=0.0)
    cosine = Parameter(0.1, 'kg m2', (-1e6, 1e6), 'Of twice the angle: more when level.', off=0.0)
    sine = Parameter(0.0, 'kg m2', (-1e6, 1e6), 'Of twice the angle, an eighth turn on.', off=0.0)
    order = Parameter(2.0, '1/rad', (0.01, 1e3), 'Periods in one turn of the other axis.')

    @staticmethod
    def law(p, s, motion, h):
        cosine, sine = cos_sin(p.order * motion.coupled_angle)
        least = (p.cosine * p.cosine + p.sine * p.sine) ** 0.5
        return p.level + least + p.cosine * cosine + p.sine * sine
