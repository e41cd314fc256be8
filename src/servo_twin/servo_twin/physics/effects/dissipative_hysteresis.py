"""A transmission whose loop is damping that levels out with the rate of the torsion."""

from math import sqrt

from ..effect import Parameter
from ..ports import Mesh


class DissipativeHysteresis(Mesh):
    r"""
    The dissipation of Ghorbel and Dhaouadi: what the rate of the torsion costs.

    .. math:: T = g^{-1}\!\left[\frac{\dot\varphi}{h(\varphi)}\right], \quad
              g^{-1}(y) = \tau_d\,\frac{y}{\sqrt{1 + y^2}}, \quad
              h(\varphi) = v_d \sqrt{1 + (\varphi/\varphi_d)^2}

    The paper leaves g and h open, and asks for an increasing g through zero and a positive h;
    these are ours. Well above the rate v_d the loop is as high at every rate; at rest there is no
    torque, so a torsion that is held does not stay where a spring with dry friction would. No
    candidate of a diagnosis: there `hysteresis` stands for loops. The rate acts explicitly: with
    the smaller inertia J seen from the load, keep the step below J v_d / level.
    """

    source = ('paper 004 eq. 5 (Ghorbel, Dhaouadi); '
              'Chua, Stromsmoe: IEEE Trans. Circuit Theory 17(4), 1970, for its form')
    candidate = False

    level = Parameter(1.0, 'N m', (0.0, 1e5), 'Half the height of a fast loop.', off=0.0)
    rate = Parameter(0.01, 'rad/s', (1e-6, 1e3), 'Of the torsion, at which it levels out.')
    reach = Parameter(1e-3, 'rad', (1e-8, 10.0), 'Torsion from which it takes higher rates.')

    @staticmethod
    def law(p, s, motion, h):
        away = motion.angle / p.reach
        y = motion.rate / (p.rate * sqrt(1.0 + away * away))
        return p.level * y / sqrt(1.0 + y * y)
