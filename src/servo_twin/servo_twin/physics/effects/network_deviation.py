"""What a model's position is off by, learned beside it from the position that was wanted."""

from ..effect import Parameter
from ..network import sigmoids
from ..ports import Sensor


class NetworkDeviation(Sensor):
    r"""
    A network of one hidden layer of sigmoids, parallel to the analytical model of the load.

    .. math:: \hat y = y + \sum_{j=1}^l v_j\,\sigma(w_{1j} x_1 + w_{2j} x_2 - a_j) - b, \quad
              \sigma(z) = \frac{1}{1 + e^{-z}}, \quad x_1 = \frac{r - r_c}{r_s}, \quad
              x_2 = \frac{y - r - d_c}{d_s}

    of the wanted position r and the position y that the analytical model gives. They are told
    apart by their difference, which is a thousandth of either: a linear form of the two inputs of
    the paper, so the network is the same one. All rows are as long as there are hidden nodes
    (paper: 10). A controller that is fed this reading is fed the correction too. Holds for motions
    like those it was trained on.
    """

    source = 'paper 001 eq. 22 to 27'
    candidate = False
    sites = ('load_position',)

    wanted_centre = Parameter(0.0, 'rad', (-1e6, 1e6), 'Wanted position that it sees as 0, r_c.')
    wanted_span = Parameter(1.0, 'rad', (1e-12, 1e6), 'Wanted position that it sees as 1, r_s.')
    behind_centre = Parameter(0.0, 'rad', (-1e6, 1e6), 'Difference that it sees as 0, d_c.')
    behind_span = Parameter(1.0, 'rad', (1e-12, 1e6), 'Difference that it sees as 1, d_s.')
    wanted = Parameter((1.0,), '', (-1e6, 1e6), 'Weight of the wanted position, each node.')
    behind = Parameter((1.0,), '', (-1e6, 1e6), 'Weight of the difference, each node.')
    threshold = Parameter((0.0,), '', (-1e6, 1e6), 'Threshold of each node.')
    weight = Parameter((1e-3,), 'rad', (-1e6, 1e6), 'What each node gives.', off=0.0)
    level = Parameter(2e-4, 'rad', (-1e6, 1e6), 'Threshold of the sum.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        x1 = (motion.reference - p.wanted_centre) / p.wanted_span
        x2 = (motion.value - motion.reference - p.behind_centre) / p.behind_span
        return motion.value + sigmoids(p.wanted, p.behind, p.threshold, p.weight, p.level, x1, x2)
