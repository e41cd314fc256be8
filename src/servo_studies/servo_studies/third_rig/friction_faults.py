"""
What resists at the bearings of motor and load, in the curves of its literature.

x is the speed over the highest, T the torque of the gear over the rated one, q the angle of the
shaft, t the time over that of a recording; each curve counts in `amount` of rated torque.
"""

from __future__ import annotations

import numpy as np

from .fault_terms import Change, Elements, Inapplicable, mechanism
from .terms import DAHL, ELASTOPLASTIC, SLIP_ELEMENTS


@mechanism('load motor')
def coulomb_friction(a, m, d, curve):
    """
    Friction of one level.

    seal: 1; Coulomb, Théorie des machines simples (1785)
    creep: 1 + 0.04 ln(1 + 500 x); Heslot, Baumberger, Perrin, Phys. Rev. E 49 (1994)
    smooth: x / sqrt(x^2 + 0.004^2); Marques, Flores, Claro, Lankarani, Nonlinear Dyn. 86 (2016)
    """
    return m.resists(a, speed={'seal': lambda x: 1.0, 'smooth': lambda x: x / np.hypot(x, 0.004),
                               'creep': lambda x: 1 + 0.04 * np.log1p(500 * x)}[curve])


@mechanism('load motor')
def viscous_friction(a, m, d, curve):
    """
    Friction that grows with speed, at most in proportion.

    petroff: x; Petroff, Inzhenerny Zhurnal (1883)
    palmgren: x^(2/3); Palmgren, Ball and Roller Bearing Engineering (1959)
    eyring: asinh(4 x) / asinh 4; Ree, Eyring, J. Appl. Phys. 26 (1955)
    """
    return m.resists(a, speed={'petroff': lambda x: x, 'palmgren': lambda x: x**(2 / 3),
                               'eyring': lambda x: np.arcsinh(4 * x) / np.arcsinh(4)}[curve])


@mechanism('load motor')
def stribeck_friction(a, m, d, curve):
    """
    Friction that falls as the shaft starts to move; s is x over 0.02 to 0.06.

    tustin: exp(-s); Tustin, J. IEE 94 IIA (1947)
    bo_pavelescu: exp(-sqrt s); Bo, Pavelescu, Wear 82 (1982)
    makkar: tanh(8 s) - tanh(s / 2); Makkar, Dixon, Sawyer, Hu, AIM (2005)
    film: (1 - s / 3)^3 up to s = 3; a film that lifts off, Hersey, J. Wash. Acad. Sci. 4 (1914)
    """
    fades = d.uniform(0.02, 0.06)
    shape = {'tustin': lambda s: np.exp(-s), 'bo_pavelescu': lambda s: np.exp(-np.sqrt(s)),
             'makkar': lambda s: np.tanh(8 * s) - np.tanh(s / 2),
             'film': lambda s: np.maximum(1 - s / 3, 0)**3}[curve]
    return m.resists(a, speed=lambda x: shape(x / fades))


@mechanism('load motor', needs='coulomb')
def presliding_friction(a, m, d, curve):
    """
    Friction that builds up over a travel, in place of sticking; z is its share of the level.

    iwan: sliders in parallel that slip evenly over the travel; Iwan, J. Appl. Mech. 33 (1966)
    maxwell_slip: travels spread by a power; Al-Bender, Lampaert, Swevers, IEEE TAC 50 (2005)
    brittle: dz/dq = (1 - z)^0.6 / travel; Dahl, AIAA J. 14 (1976)
    elastoplastic: elastic to z = 0.6, then slipping; Dupont et al., IEEE TAC 47 (2002)
    """
    travel = a * 0.02 * m.turns * min(1.0, m.travel) * d.uniform(0.7, 1.4)
    share = (np.arange(12) + 0.5) / 12
    twelve, one = np.full(12, 1 / 12), (np.array([travel]), np.ones(1))
    return Change(memory={m.site: {
        'iwan': Elements(SLIP_ELEMENTS, travel * share, twelve),
        'maxwell_slip': Elements(SLIP_ELEMENTS, travel * 1.5 * share**3, twelve),
        'brittle': Elements(DAHL, *one, power=0.6),
        'elastoplastic': Elements(ELASTOPLASTIC, *one, power=0.6)}[curve]})


@mechanism('load motor')
def asymmetric_friction(a, m, d, curve):
    """
    Friction that one direction has and the other has not.

    level: 1; Canudas de Wit, Åström, Braun, IEEE J. Robotics Autom. 3 (1987)
    slope: x; the same
    root: sqrt x; Canudas de Wit, Noël, Aubin, Brogliato, Int. J. Robotics Res. 10 (1991)
    """
    way = m.way
    return m.resists(a, m.by('direction', lambda s: (s * way > 0) * 1.0),
                     speed={'level': lambda x: 1.0, 'slope': lambda x: x, 'root': np.sqrt}[curve])


@mechanism('load', needs='external')
def load_dependent_friction(a, m, d, curve):
    """
    Friction that grows with the torque of the gear.

    amontons: |T|; Amontons, Mém. Acad. R. Sci. (1699)
    rolling: |T|^0.54; SKF, Rolling Bearings, G_rr (2018)
    palmgren: |T|^1.5; Palmgren, Ball and Roller Bearing Engineering (1959)
    back_driven: |T|, 2.5 times that while the load drives; Dohring, Lee, Newman, ICRA (1993)
    """
    shape = {'amontons': np.abs, 'rolling': lambda x: np.abs(x)**0.54,
             'palmgren': lambda x: np.abs(x)**1.5,
             'back_driven': lambda x: np.where(x > 0, x, -2.5 * x)}[curve]
    return m.resists(a, m.by('driven_torque', lambda T: shape(T / m.load_torque)))


@mechanism('load motor')
def position_dependent_friction(a, m, d, curve):
    """
    Friction that varies over the turn or the stroke; p is the phase n q + p0.

    misaligned: (1 + cos p) / 2, n 1 to 3; Popović, Goldenberg, IEEE Trans. Robot. Autom. 14 (1998)
    rollers: |sin(p / 2)|, n 5 to 9; Harris, Rolling Bearing Analysis, ch. 25 (2001)
    tight_spot: cos^2 over a third of a turn; a local defect, Randall, Antoni, MSSP 25 (2011)
    stroke: (q / travel)^2; ball screws between two bearings, Verl, Frey, CIRP Annals 59 (2010)
    """
    phase = d.uniform(0, 2 * np.pi)
    few, many = m.order(d, 1, 2, 3), m.order(d, 5, 7, 9)
    if curve == 'stroke':
        reach = m.travel * m.turns
        return m.resists(a, m.by(f'{m.site}_angle', lambda q: np.minimum((q / reach)**2, 2.0)))
    shape, order = {'misaligned': (lambda p: (1 + np.cos(p + phase)) / 2, few),
                    'rollers': (lambda p: np.abs(np.sin(p / 2 + phase)), many),
                    'tight_spot': (lambda p: np.cos(np.clip(1.5 * _around(p + phase), -np.pi / 2,
                                                            np.pi / 2))**2, 1.0)}[curve]
    return m.resists(2 * a, m.turn(shape, order))


def _around(p):
    """Return an angle within half a turn of zero."""
    return (p + np.pi) % (2 * np.pi) - np.pi


@mechanism('load motor')
def quadratic_drag(a, m, d, curve):
    """
    Drag of a fluid.

    rayleigh: x^2; Rayleigh, Phil. Mag. 2 (1876)
    blasius: x^1.75; turbulent film, Blasius, VDI Forschungsheft 131 (1913)
    churning: (x - 0.3)^2 beyond 0.3; Changenet, Velex, ASME J. Mech. Des. 129 (2007)
    """
    return m.resists(a, speed={'rayleigh': lambda x: x**2, 'blasius': lambda x: x**1.75,
                               'churning': lambda x: np.maximum(x - 0.3, 0)**2}[curve])


@mechanism('load')
def friction_drift(a, m, d, curve):
    """
    Friction that changes during a recording; W is the temperature rise over 5 to 15 K.

    settling: exp(-t / 0.1 to 0.4); Bittencourt, Wernholt, Sander-Tavallaey, Brogårdh, IROS (2010)
    churning_phase: 1 - ln(1 + 50 t) / ln 51; run-in of grease, Lugt, Tribol. Trans. 52 (2009)
    preload: W, a bearing that grows tight; Bossmanns, Tu, Int. J. Mach. Tools Manuf. 39 (1999)
    thinning: x (exp(-W) - 1); Reynolds, Phil. Trans. 177 (1886), Simoni et al., IROS (2015)
    """
    fades, warm = d.uniform(0.1, 0.4) * m.seconds, d.uniform(5, 15)
    if curve in ('preload', 'thinning') and not m.plant.heat:
        raise Inapplicable('it measures no temperature')
    if curve == 'thinning':
        return m.resists(a, m.by('temperature_rise', lambda w: np.exp(-w / warm) - 1),
                         speed=lambda x: x)
    if curve == 'preload':
        return m.resists(a, m.by('temperature_rise', lambda w: w / warm))
    shape = {'settling': lambda t: np.exp(-t / fades), 'churning_phase': lambda t: np.maximum(
        0, 1 - np.log1p(50 * t / m.seconds) / np.log(51))}[curve]
    return m.resists(a, m.by('time', shape))
