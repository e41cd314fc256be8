"""Angle that a harmonic drive adds and takes as its wave generator turns."""

from ..effect import Parameter
from ..harmonics import wave, wave_slope
from ..ports import MeshError


class KinematicError(MeshError):
    r"""
    Orders of the motor turn, from twice a turn on.

    .. math:: \tilde\theta_p = \sum_{i=1}^n a_i \cos(i E \theta_m) + b_i \sin(i E \theta_m)

    Its slope over the motor angle acts back on the motor, as in the paper: a torque T on the load
    costs the motor :math:`T (1/N - d\tilde\theta_p/d\theta_m)`, so that the error makes no
    energy. The paper counts the error with the other sign, as an angle that the load has gained.
    No candidate of a diagnosis: there `transmission_error`, whose orders are of the load turn,
    stands for it. Holds while the error does not depend on torque.
    """

    source = 'paper 004 eq. 4 (Ghorbel, Gandhi)'
    candidate = False

    order = Parameter(2.0, '1/rad', (0.1, 1e4), 'First order, per turn of the motor.')
    cosine = Parameter((1e-4,), 'rad', (-0.1, 0.1), 'Of each multiple.', off=0.0)
    sine = Parameter((0.0,), 'rad', (-0.1, 0.1), 'Of each multiple.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return wave(p.cosine, p.sine, p.order * motion.motor_angle)

    @staticmethod
    def motor_slope(p, motion):
        """Return how the angle lost grows with the motor angle, rad/rad."""
        return p.order * wave_slope(p.cosine, p.sine, p.order * motion.motor_angle)
