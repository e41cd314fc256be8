"""A gap that is set by moving one gear away from the other."""

from ..effect import Parameter
from ..elementary_functions import cos_sin
from ..ports import Clearance


class CarrierBacklash(Clearance):
    r"""
    Play over the setting of a slide, straight between the settings where it is known.

    .. math:: \theta_h = \left(w_k + \frac{s - s_k}{s_{k+1} - s_k}(w_{k+1} - w_k)\right)
              (1 + a\cos\theta_l + b\sin\theta_l), \quad s_k \le s \le s_{k+1}

    Gears that do not run true vary it over the turn. Beyond the outermost settings the nearest
    line goes on. ``settings`` rise. No candidate of a
    diagnosis: the setting is read off the slide, and play beside the curve is `backlash`.
    """

    source = 'paper 002 section 5.1, figure 5.1: play over the setting of the carrier'
    candidate = False

    setting = Parameter(0.01, 'm', (0.0, 10.0), 'Where the slide stands.')
    settings = Parameter((0.009, 0.015), 'm', (0.0, 10.0), 'At which the backlash is known.')
    widths = Parameter((0.0, 0.08), 'rad', (0.0, 1.0), 'From flank to flank there.', off=0.0)

    cosine = Parameter(0.0, '', (-10.0, 10.0), 'Relative, over the turn of the load.')
    sine = Parameter(0.0, '', (-10.0, 10.0), 'Relative, over the turn of the load.')

    @staticmethod
    def law(p, s, motion, h):
        cosine, sine = cos_sin(motion.load_angle)
        round_it = 1.0 + p.cosine * cosine + p.sine * sine
        last = len(p.settings) - 1
        if last == 0:
            return p.widths[0] * round_it
        k = 1
        while k < last and p.setting > p.settings[k]:
            k += 1
        rise = p.settings[k] - p.settings[k - 1]
        if rise <= 0.0:
            return p.widths[k] * round_it
        share = (p.setting - p.settings[k - 1]) / rise
        return (p.widths[k - 1] + share * (p.widths[k] - p.widths[k - 1])) * round_it
