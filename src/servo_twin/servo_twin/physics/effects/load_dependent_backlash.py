"""A gap that opens as the teeth and bearings give under load."""

from ..effect import Parameter
from ..elementary_functions import exp
from ..ports import Clearance


class LoadDependentBacklash(Clearance):
    r"""
    Lost motion that grows with the load and levels out.

    .. math:: \theta_h = a\left(1 - e^{-|T|/T_0}\right)

    T follows the transmitted torque with a lag of ``settling``, so that gap and torque, which
    depend on each other, do not chatter: ``settling`` must stay above the step times
    stiffness times a / (4 T_0). Holds for slow changes of load.
    """

    source = 'paper 000 eq. 4 and fig. 6'
    memory = 1

    growth = Parameter(3e-4, 'rad', (0.0, 1.0), 'Width that a large load opens.', off=0.0)
    load = Parameter(100.0, 'N m', (1e-6, 1e6), 'Torque by which most of it is open.',
                     grid=(30.0, 100.0, 300.0))
    settling = Parameter(0.01, 's', (0.0, 10.0), 'Time in which the gap follows the load.',
                         grid=(1e-3, 1e-2))

    @staticmethod
    def law(p, s, motion, h):
        load = abs(motion.torque)
        if h > 0.0:
            load = s[0] + h / (h + p.settling) * (load - s[0])
        s[0] = load
        return p.growth * (1.0 - exp(-load / p.load))
