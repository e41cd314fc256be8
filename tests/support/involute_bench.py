"""The bench of paper 002 without its faults, and the backlash of its gears as drawn."""

from math import cos, pi, tan
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from servo_rig_driver.emulated.rig_file import load_rig

RIG = load_rig(Path(__file__).parents[2] / 'config' / 'rigs' / 'ema_bench.yaml')
PLAIN = {'mesh.backlash_load': 0.0, 'mesh.backlash_position': 0.0, 'mesh.softening': 0.0,
         'mesh.hysteresis': 0.0, 'error.tooth': 0.0, 'error.turn': 0.0, 'carrier.arc': 0.0,
         'carrier.waviness': 0.0, 'mesh.gap': 0.0, 'sensors.noise': 0.0}


def drawn_play(apart, radius=0.045, alpha=0.349, teeth=30):
    """
    Return the backlash of two equal involute gears, rad, from drawn flanks.

    A tooth of one stands in a space of the other; it is turned until a point of its flank touches.
    """
    def half_tooth(r):
        bearing = np.arccos(np.minimum(1.0, radius * cos(alpha) / r))
        return 0.5 * pi / teeth + (tan(alpha) - alpha) - (np.tan(bearing) - bearing)

    r = np.linspace(radius * cos(alpha), radius + 0.003, 4000)

    def room(turned):
        angle = half_tooth(r) + turned  # of points of its flank, from the line of the shafts
        across, along = r * np.sin(angle), apart - r * np.cos(angle)
        at = np.hypot(across, along)
        inside = (at > radius * cos(alpha)) & (at < radius + 0.003)
        return np.min((pi / teeth - half_tooth(at) - np.arctan2(across, along))[inside])

    return 2.0 * brentq(room, -0.01, 0.1)
