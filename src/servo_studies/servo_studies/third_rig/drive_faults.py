"""
What a drive does besides, in the curves of its literature.

u is the command over that of rated torque, t the time over that of a recording.
"""

from __future__ import annotations

import numpy as np

from .fault_terms import Change, Inapplicable, mechanism
from .plant import FIRST_ORDER, SECOND_ORDER, SLEW

FAST = 0.01  # s, what an amount of one of a lag or delay is


@mechanism('drive', needs='current_drive')
def current_lag(a, m, d, curve):
    """
    A current that follows its reference late.

    first_order: within amount / 100 s; Leonhard, Control of Electrical Drives (2001)
    second_order: damping 0.45 of a PI loop; Schröder, Elektrische Antriebe 2 (2015)
    slew: at most rated current in amount / 100 s; a supply's voltage over an inductance, Leonhard
    """
    kind, lag = {'first_order': (FIRST_ORDER, a * FAST), 'second_order': (SECOND_ORDER, a * FAST),
                 'slew': (SLEW, m.current / (a * FAST))}[curve]
    return Change({'lag_kind': kind, 'lag': lag})


@mechanism('drive')
def command_delay(a, m, d, curve):
    """
    A command that arrives late.

    constant: by amount / 100 s; Åström, Wittenmark, Computer-Controlled Systems (1997)
    two_valued: by half or one and a half of that, by chance; Nilsson, Lund thesis (1998)
    beat: by a sawtooth from zero to twice that; Wittenmark, Nilsson, Törngren, ACC (1995)
    """
    late, seed, rate = a * FAST, d.integers(2**31), d.uniform(0.003, 0.02)

    def two(k):
        return late * (0.5 + np.random.default_rng(seed).integers(0, 2, len(k)))
    return Change(delay={'constant': lambda k: np.full(len(k), late), 'two_valued': two,
                         'beat': lambda k: 2 * late * (rate * k % 1.0)}[curve])


@mechanism('drive')
def drive_dead_band(a, m, d, curve):
    """
    A drive that does not answer small commands; w is amount.

    clipped: u - clip(u, -w, w); Tao, Kokotović, IEEE TAC 39 (1994)
    jump: nothing below w, all above; a lapped spool, Merritt, Hydraulic Control Systems (1967)
    crossover: u^3 / (u^2 + w^2); a push-pull stage, Horowitz, Hill, The Art of Electronics (2015)
    dead_time: u - w I / sqrt(I^2 + 0.03^2) of an inverter; Jeong, Park, IEEE TIE 38 (1991)
    """
    w = a * m.command
    if curve == 'dead_time':
        if not m.plant.resistance:
            raise Inapplicable('its current loop hides a dead time')
        return m.adds('command', m.by('current', lambda i: -w * (i / m.current) / np.hypot(
            i / m.current, 0.03)))
    return m.adds('command', m.by('command', {
        'clipped': lambda u: -np.clip(u, -w, w), 'jump': lambda u: np.where(abs(u) < w, -u, 0.0),
        'crossover': lambda u: -u * w**2 / (u**2 + w**2)}[curve]))


@mechanism('drive')
def drive_saturation(a, m, d, curve):
    """
    A drive that gives less than is asked for; its ceiling is amount^(-1/3).

    clipped: at the ceiling; Hu, Lin, Control Systems with Actuator Saturation (2001)
    knee: a fifth of what is beyond; a supply with an inner resistance, Horowitz, Hill (2015)
    foldback: less the more is asked for, to 0.3 of the ceiling; Horowitz, Hill, sec. 9.13 (2015)
    arctan: 2 / pi of the ceiling by atan; a stage that saturates softly, Horowitz, Hill (2015)
    """
    top = m.command * a**(-1 / 3)
    shape = {'clipped': lambda u: np.minimum(u, top),
             'knee': lambda u: np.minimum(u, top) + 0.2 * np.maximum(u - top, 0),
             'foldback': lambda u: np.where(u < top, u, np.maximum(2 * top - u, 0.3 * top)),
             'arctan': lambda u: top * 2 / np.pi * np.arctan(np.pi * u / 2 / top)}[curve]
    return m.adds('command', m.by('command', lambda u: np.sign(u) * (shape(abs(u)) - abs(u))))


@mechanism('drive', name='parameter:gain')
def gain(a, m, d, curve):
    """
    A gain that is more or less by a share 1 - exp(-amount).

    constant: of all commands; any amplifier
    one_sided: of positive commands; an unequal bridge, Horowitz, Hill (2015)
    warming: by 1 - exp(-t / 0.2 to 0.5); drift of a shunt, Horowitz, Hill (2015)
    """
    more, fades = m.way * (1 - np.exp(-a)), d.uniform(0.2, 0.5) * m.seconds
    if curve == 'warming':
        return m.adds('command', m.by('command', lambda u: more * u), m.by(
            'time', lambda t: 1 - np.exp(-t / fades)))
    return m.adds('command', m.by('command', lambda u: more * (
        np.maximum(u, 0) if curve == 'one_sided' else u)))
