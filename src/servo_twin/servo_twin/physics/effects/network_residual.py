"""Whatever a model lacks, learned as a black box beside it."""

from ..effect import Parameter
from ..network import sigmoids
from ..ports import Torque


class NetworkResidual(Torque):
    r"""
    A network of one hidden layer of sigmoids over current and speed, parallel to the other laws.

    .. math:: \tau = \sum_{j=1}^l v_j\,\sigma(w_{1j} x_1 + w_{2j} x_2 - a_j) - b, \quad
              \sigma(z) = \frac{1}{1 + e^{-z}}, \quad x_1 = \frac{i - i_c}{i_s}, \quad
              x_2 = \frac{\omega - \omega_c}{\omega_s}

    The paper adds its network, of command and analytical position, to the position that the
    analytical model gives. Here it adds to the torque, so that its correction passes the mechanism
    and nothing jumps. Its inputs are the command as it arrives (a current) and the model's own
    speed. All rows are as long as there are hidden nodes (paper: 10). Nothing keeps it from
    driving: it holds for motions like those it was trained on.
    """

    source = 'paper 001 eq. 22 to 25 and 27'
    candidate = False

    current_centre = Parameter(0.0, 'A', (-1e6, 1e6), 'Current that the network sees as 0.')
    current_span = Parameter(1.0, 'A', (1e-9, 1e6), 'Current that it sees as 1.')
    speed_centre = Parameter(0.0, 'rad/s', (-1e6, 1e6), 'Speed that the network sees as 0.')
    speed_span = Parameter(1.0, 'rad/s', (1e-9, 1e6), 'Speed that it sees as 1.')
    current = Parameter((1.0,), '', (-1e6, 1e6), 'Weight of the current, each node.')
    speed = Parameter((1.0,), '', (-1e6, 1e6), 'Weight of the speed, each node.')
    threshold = Parameter((0.0,), '', (-1e6, 1e6), 'Threshold of each node.')
    weight = Parameter((0.5,), 'N m', (-1e6, 1e6), 'What each node gives.', off=0.0)
    level = Parameter(0.1, 'N m', (-1e6, 1e6), 'Threshold of the sum.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        x1 = (motion.current - p.current_centre) / p.current_span
        x2 = (motion.speed - p.speed_centre) / p.speed_span
        return sigmoids(p.current, p.speed, p.threshold, p.weight, p.level, x1, x2)
