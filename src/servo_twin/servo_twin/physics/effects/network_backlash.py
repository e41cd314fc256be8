"""Lost motion learned from measurements."""

from math import pi

from ..effect import Parameter
from ..elementary_functions import whole
from ..network import two_layers
from ..ports import Clearance


class NetworkBacklash(Clearance):
    r"""
    A network of one hidden layer over load angle and load.

    .. math:: \theta_h = \sum_{j=1}^m v_j \tanh(w_{1j} x_1 + w_{2j} x_2 - \alpha_j) - \beta, \quad
              x_1 = \frac{\theta_l \bmod \theta_0 - \theta_c}{\theta_s}, \quad
              x_2 = \frac{|T| - T_c}{T_s}

    T follows the transmitted torque with a lag of ``settling``, so that gap and torque, which
    depend on each other, do not chatter. All rows are as long as there are hidden nodes (paper:
    30). Holds within the angles and loads it was trained on; outside, it levels out.
    """

    source = 'paper 000 eq. 4, 5, 6'
    candidate = False
    memory = 33

    turn = Parameter(2.0 * pi, 'rad', (1e-6, 1e9), 'Angle after which the gap repeats.')
    angle_centre = Parameter(pi, 'rad', (-1e9, 1e9), 'Angle that the network sees as 0.')
    angle_span = Parameter(pi, 'rad', (1e-9, 1e9), 'Angle that it sees as 1.')
    load_centre = Parameter(0.0, 'N m', (-1e6, 1e6), 'Torque that the network sees as 0.')
    load_span = Parameter(100.0, 'N m', (1e-9, 1e6), 'Torque that it sees as 1.')
    settling = Parameter(0.01, 's', (0.0, 10.0), 'Time in which the gap follows the load.')
    angle = Parameter((1.0,), '', (-1e6, 1e6), 'Weight of the angle, each node.')
    load = Parameter((1.0,), '', (-1e6, 1e6), 'Weight of the load, each node.')
    threshold = Parameter((0.0,), '', (-1e6, 1e6), 'Threshold of each node.')
    weight = Parameter((1e-4,), 'rad', (-1.0, 1.0), 'What each node gives.', off=0.0)
    level = Parameter(-3e-4, 'rad', (-1.0, 1.0), 'Threshold of the sum.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        load = abs(motion.torque)
        if h > 0.0:
            load = s[32] + h / (h + p.settling) * (load - s[32])
        s[32] = load
        angle = motion.load_angle - p.turn * whole(motion.load_angle / p.turn)
        x1 = (angle - p.angle_centre) / p.angle_span
        x2 = (load - p.load_centre) / p.load_span
        return two_layers(p.angle, p.load, p.threshold, p.weight, x1, x2, s) - p.level
