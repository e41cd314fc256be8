"""Friction learned from measurements: one network forward, one in reverse."""

from math import pi

from ..effect import Parameter
from ..elementary_functions import whole
from ..network import two_layers
from ..ports import Friction


class NetworkFriction(Friction):
    r"""
    A network of one hidden layer over angle and speed for each direction.

    .. math:: \tau_f = \sum_{j=1}^m v_j \tanh(w_{1j} x_1 + w_{2j} x_2 - \alpha_j) - \beta, \quad
              x_1 = \frac{\theta \bmod \theta_0 - \theta_c}{\theta_s}, \quad
              x_2 = \frac{|\omega| - \omega_c}{\omega_s}

    All rows are as long as there are hidden nodes (paper: 30). Holds within the angles and speeds
    it was trained on; outside, it levels out.
    """

    source = 'paper 000 eq. 3, 5, 6'
    candidate = False
    memory = 32

    turn = Parameter(2.0 * pi, 'rad', (1e-6, 1e9), 'Angle after which friction repeats.')
    angle_centre = Parameter(pi, 'rad', (-1e9, 1e9), 'Angle that the network sees as 0.')
    angle_span = Parameter(pi, 'rad', (1e-9, 1e9), 'Angle that it sees as 1.')
    speed_centre = Parameter(0.0, 'rad/s', (-1e6, 1e6), 'Speed that the network sees as 0.')
    speed_span = Parameter(1.0, 'rad/s', (1e-9, 1e6), 'Speed that it sees as 1.')
    forward_angle = Parameter((1.0,), '', (-1e6, 1e6), 'Weight of the angle, each node.')
    forward_speed = Parameter((1.0,), '', (-1e6, 1e6), 'Weight of the speed, each node.')
    forward_threshold = Parameter((0.0,), '', (-1e6, 1e6), 'Threshold of each node.')
    forward_weight = Parameter((0.5,), 'N m', (-1e6, 1e6), 'What each node gives.', off=0.0)
    forward_level = Parameter(-1.0, 'N m', (-1e6, 1e6), 'Threshold of the sum.', off=0.0)
    reverse_angle = Parameter((1.0,), '', (-1e6, 1e6), 'Weight of the angle, each node.')
    reverse_speed = Parameter((1.0,), '', (-1e6, 1e6), 'Weight of the speed, each node.')
    reverse_threshold = Parameter((0.0,), '', (-1e6, 1e6), 'Threshold of each node.')
    reverse_weight = Parameter((0.5,), 'N m', (-1e6, 1e6), 'What each node gives.', off=0.0)
    reverse_level = Parameter(-1.0, 'N m', (-1e6, 1e6), 'Threshold of the sum.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        angle = motion.angle - p.turn * whole(motion.angle / p.turn)
        x1 = (angle - p.angle_centre) / p.angle_span
        x2 = (abs(motion.speed) - p.speed_centre) / p.speed_span
        if motion.direction > 0.0:
            return two_layers(p.forward_angle, p.forward_speed, p.forward_threshold,
                              p.forward_weight, x1, x2, s) - p.forward_level
        return two_layers(p.reverse_angle, p.reverse_speed, p.reverse_threshold,
                          p.reverse_weight, x1, x2, s) - p.reverse_level
