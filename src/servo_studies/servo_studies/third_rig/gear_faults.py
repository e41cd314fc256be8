"""
What a gear does besides, in the curves of its literature.

c is the twist that carries torque over that at rated torque, T the torque over the rated one, q
the angle of the load.
"""

from __future__ import annotations

import numpy as np

from .fault_terms import Change, Elements, mechanism
from .terms import DAHL, RELAXING, SLIP_ELEMENTS


@mechanism('mesh', needs='compliant')
def stiffness_error(a, m, d, curve):
    """
    A gear of another stiffness: by exp(+-amount), or by a share 1 - exp(-amount).

    constant: at any angle; any data sheet, some 20 %
    tooth_pairs: cos p, pairs in contact, 8 to 30 a turn; Kahraman, Singh, JSV 146 (1991)
    warming: by 1 - exp(-t / 0.2 to 0.5), of a polymer; Hooke, Mao, Walton et al., J. Tribol. 115
    """
    more, share = np.expm1(a * m.way), 1 - np.exp(-a)
    order, fades = m.order(d, 8, 12, 20, 30), d.uniform(0.2, 0.5) * m.seconds
    m = m.at('load')
    return m.adds('stiffness', {'constant': lambda: m.by('time', lambda t: more),
                                'tooth_pairs': lambda: m.turn(lambda p: share * np.cos(p), order),
                                'warming': lambda: m.by('time', lambda t: -share * (
                                    1 - np.exp(-t / fades)))}[curve]())


@mechanism('mesh', needs='compliant')
def nonlinear_stiffness(a, m, d, curve):
    """
    A torque that is not in proportion to the twist; s is 1 - exp(-amount).

    cubic: c + amount c^3; Duffing, Erzwungene Schwingungen (1918)
    three_stages: slopes 1 - s to 0.15, 1 - s / 2 to 0.5, then 1; catalogues of strain-wave gears
    hertz: (1 - s) c + s c^(3/2); Hertz, J. reine angew. Math. 92 (1882)
    soft_core: slope 1 - s / (1 + (c / 0.3)^2); Kircanski, Goldenberg, Int. J. Robotics Res. 16
    """
    s = 1 - np.exp(-a)
    shape = {'cubic': lambda c: a * c**3,
             'three_stages': lambda c: -s / 2 * (np.clip(c, -.15, .15) + np.clip(c, -.5, .5)),
             'hertz': lambda c: s * c * (np.sqrt(abs(c)) - 1),
             'soft_core': lambda c: -s * 0.3 * np.arctan(c / 0.3)}[curve]
    return m.adds('gear_torque', m.by('contact', lambda c: m.load_torque * shape(c / m.twist)))


@mechanism('mesh', needs='compliant')
def backlash(a, m, d, curve):
    """
    A gap between the teeth, `amount` of the twist at rated torque wide.

    hard: a dead zone; Nordin, Gutman, Automatica 38 (2002)
    crushed: a damping that grows with the contact; Hunt, Crossley, J. Appl. Mech. 42 (1975)
    oil: a film that resists inside the gap; Brancati, Rocca, Russo, Mech. Mach. Theory 40 (2005)
    """
    width = a * m.twist
    return Change({'gap': m.plant.gap + width, **{
        'hard': {}, 'crushed': {'crush': 0.3 * width},
        'oil': {'oil': 0.2 * m.plant.damping}}[curve]})


@mechanism('mesh', needs='compliant external')
def load_dependent_backlash(a, m, d, curve):
    """
    A gap that the torque opens, and that follows it within 5 to 30 ms.

    saturating: 1 - exp(-2 |T|); the shape of lost motion in catalogues of cycloid gears
    housing: |T|; bearings that give, Walha, Fakhfakh, Haddar, Mech. Mach. Theory 44 (2009)
    hertz: |T|^(2/3); Hertz, J. reine angew. Math. 92 (1882)
    """
    shape = {'saturating': lambda x: 1 - np.exp(-2 * x), 'housing': lambda x: x,
             'hertz': lambda x: x**(2 / 3)}[curve]
    return Change({'gap_time': d.uniform(0.005, 0.03)}) + m.adds('gap_by_load', m.by(
        'torque', lambda T: a * m.twist * shape(abs(T) / m.load_torque)))


@mechanism('mesh', needs='compliant')
def position_dependent_backlash(a, m, d, curve):
    """
    A gap that varies over the turn of the load; p is n q + p0.

    eccentric: (1 + cos p) / 2, n 1 or 2; Smith, Gear Noise and Vibration (2003)
    worn: cos^2 over 0.4 of a turn about the middle; Flodin, Andersson, Wear 207 (1997)
    oval: | |p| - pi | / pi, n 2; an oval rim, Smith, Gear Noise and Vibration (2003)
    """
    phase, order = d.uniform(0, 6), d.choice([1.0, 2.0])
    shape, order = {'eccentric': (lambda p: (1 + np.cos(p + phase)) / 2, order),
                    'worn': (lambda p: np.cos(np.clip(1.25 * ((p + np.pi) % (2 * np.pi) - np.pi),
                                                      -np.pi / 2, np.pi / 2))**2, 1.0),
                    'oval': (lambda p: abs((p + phase) % (2 * np.pi) - np.pi) / np.pi, 2.0)}[curve]
    return m.adds('gap', m.at('load').turn(lambda p: a * m.twist * shape(p), order))


@mechanism('mesh', needs='compliant')
def hysteresis(a, m, d, curve):
    """
    A gear whose torque remembers the twist.

    iwan: sliders that slip evenly over 0.3 to 0.8 of c; Iwan, J. Appl. Mech. 33 (1966)
    power: travels spread by a power; Ruderman, Hoffmann, Bertram, IEEE TIE 56 (2009)
    ductile: dz/dc = (1 - z)^1.5 over a travel; Dahl, AIAA J. 14 (1976)
    relaxing: two springs behind dampers, 0.05 and 0.4 s; Maxwell, Phil. Trans. 157 (1867)
    """
    reach, share = m.twist * d.uniform(0.3, 0.8), (np.arange(12) + 0.5) / 12
    high = a * m.load_torque
    return Change(memory={'mesh': {
        'iwan': Elements(SLIP_ELEMENTS, reach * share, np.full(12, 1 / 12), high),
        'power': Elements(SLIP_ELEMENTS, 2 * reach * share**3, np.full(12, 1 / 12), high),
        'ductile': Elements(DAHL, np.array([reach / 2]), np.ones(1), high, power=1.5),
        'relaxing': Elements(RELAXING, np.full(2, m.twist), np.array([0.6, 0.4]), high,
                             lapse=np.array([0.05, 0.4]))}[curve]})


@mechanism('mesh', needs='compliant load')
def transmission_error(a, m, d, curve):
    """
    Angle that the teeth add and take, `amount` of the twist at rated torque; p is n q + p0.

    runout: sin p + 0.4 sin 2p, n 1 or 3 of the load; Smith, Gear Noise and Vibration (2003)
    wave: sin 2p + 0.3 sin 4p of the motor; Tuttle, Seering, IEEE Trans. Robot. Autom. 12 (1996)
    teeth: sin p + 0.3 sin 2p, n 20 to 60, less on one flank; Velex, Maatar, JSV 191 (1996)
    pitch: chance, orders 1 to 30 of the load by 1/n; Mark, J. Acoust. Soc. Am. 63 (1978)
    """
    p0, size = d.uniform(0, 2 * np.pi), a * m.twist
    m = m.at('load')
    if curve == 'runout':
        return m.adds('load_error', m.turn(
            lambda p: size * (np.sin(p + p0) + 0.4 * np.sin(2 * p)), m.order(d, 1, 3)))
    if curve == 'wave':
        return m.adds('motor_error', m.at('motor').turn(
            lambda p: size * (np.sin(p + p0) + 0.3 * np.sin(2 * p)), 2.0))
    if curve == 'teeth':
        return m.adds('load_error', m.turn(
            lambda p: size * (np.sin(p + p0) + 0.3 * np.sin(2 * p)), m.order(d, 20, 36, 60)),
            m.by('flank', lambda s: 0.8 + 0.2 * s))
    phases = d.uniform(0, 2 * np.pi, 30)
    return m.adds('load_error', m.turn(lambda q: size * sum(
        np.sin(n * q + phases[n - 1]) / n for n in range(1, 31))))
