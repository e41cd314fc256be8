"""A torque sensor that reads another torque while it rises than while it falls."""

from ..effect import Parameter
from ..maxwell_slip import slipped
from ..ports import Sensor


class TorqueSensorHysteresis(Sensor):
    r"""
    Four Maxwell-slip elements over the torque, in the reading alone.

    .. math:: y = x + \frac{\tau_s}{4} \sum_{i=1}^4 \frac{z_i}{d_i}, \quad
              d_i = \frac{i}{4} d, \quad
              z_i \leftarrow \min(\max(z_i + \Delta x, -d_i), d_i)

    Independent of rate; relaxed at the first reading. Below zero the reading lags. Holds while
    creep of the sensor does not matter.
    """

    source = ('Al-Bender, Lampaert, Swevers: IEEE TAC 50(11), 2005; '
              'data sheets of torque sensors, hysteresis')
    sites = ('torque',)
    candidate = False
    memory = 6

    level = Parameter(0.1, 'N m', (-1e5, 1e5), 'Half the height of a wide loop.', off=0.0)
    travel = Parameter(1.0, 'N m', (1e-9, 1e6), 'Torque over which all elements slip.',
                       grid=(0.3, 1.0, 3.0))

    @staticmethod
    def law(p, s, motion, h):
        moved = (motion.value - s[4]) * s[5]
        s[4], s[5] = motion.value, 1.0
        return motion.value + 0.25 * p.level * slipped(s, moved, p.travel)
