"""An encoder that reads whole counts."""

from ..effect import Parameter
from ..elementary_functions import whole
from ..ports import Sensor


class EncoderCounts(Sensor):
    r"""
    Rounding to the nearest count.

    .. math:: y = q \lfloor x/q + 1/2 \rfloor

    An encoder of n counts a turn has q = 2 pi / n. Holds for a graduation without error.
    """

    source = 'Widrow, Kollar: Quantization Noise, 2008, ch. 1'
    candidate = False
    sites = ('motor_position', 'load_position')

    count = Parameter(6.2832e-4, 'rad', (0.0, 1.0), 'Angle of one count.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        if p.count <= 0.0:
            return motion.value
        return p.count * whole(motion.value / p.count + 0.5)
