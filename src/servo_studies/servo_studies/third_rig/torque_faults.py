"""
What acts on motor and load beside friction: torques, the magnets, inertias and a soft payload.

q is the angle of the load, p a phase n q + p0 of the shaft, I the current over that of rated
torque, t the time over that of a recording.
"""

from __future__ import annotations

import numpy as np

from .fault_terms import Change, mechanism
from .plant import DRY, HARDENING, LINEAR, SWINGING


@mechanism('motor')
def cogging(a, m, d, curve):
    """
    Torque of the magnets on the teeth, at any current; n 6 to 36.

    slots: sum of sin(k p) / k^2 up to k = 3; Zhu, Howe, IEEE Trans. Magn. 28 (1992)
    edges: p exp(-3 p^2) around each tooth; narrow slot openings, Zhu, Howe, IEEE TEC 15 (2000)
    uneven: sin p (1 + 0.6 cos q), a rotor off centre; Gašparin, Černigoj, Fišer, COMPEL 28 (2009)
    """
    order, phase = m.order(d, 6, 12, 18, 24, 36), d.uniform(0, 2 * np.pi)
    if curve == 'uneven':
        return m.adds('motor_torque', m.turn(lambda q: a * m.torque * np.sin(order * q + phase) * (
            1 + 0.6 * np.cos(q))))
    shape = {'slots': lambda p: sum(np.sin(k * (p + phase)) / k**2 for k in (1, 2, 3)),
             'edges': lambda p: 4 * (p - np.pi) * np.exp(-3 * (p - np.pi)**2)}[curve]
    return m.adds('motor_torque', m.turn(lambda p: a * m.torque * shape(p), order))


@mechanism('motor')
def torque_ripple(a, m, d, curve):
    """
    Torque constant that varies by 1 - exp(-amount); w is the electrical angle, 2 to 11 a turn.

    six_step: cos w within 30 degrees of each sixth; Carlson, Lajoie-Mazenc, IEEE TIA 28 (1992)
    commutator: |sin(p / 2)|, n 9 to 15 bars; any textbook of brushed machines
    unequal_gains: sin 2w; Chung, Sul, IEEE Trans. Ind. Appl. 34 (1998)
    harmonics: sin 6w + 0.4 sin 12w; Holtz, Springob, IEEE Trans. Ind. Electron. 43 (1996)
    """
    poles, bars, phase = d.choice([2.0, 4.0, 7.0, 11.0]), d.choice([9., 13., 15.]), d.uniform(0, 6)
    shape, order = {
        'six_step': (lambda p: 10 * (np.cos(p / 6 - np.pi / 6) - 3 / np.pi), 6 * poles),
        'commutator': (lambda p: 1.5 * (np.abs(np.sin(p / 2)) - 2 / np.pi), bars),
        'unequal_gains': (lambda p: np.sin(p + phase), 2 * poles),
        'harmonics': (lambda p: np.sin(p + phase) + 0.4 * np.sin(2 * p), 6 * poles)}[curve]
    share = 1 - np.exp(-a)
    return m.adds('motor_torque', m.turn(shape, order), _of_current(m, lambda i: share * i))


def _of_current(m, law):
    """Return a torque at the motor as a curve of the current over the rated one."""
    return m.by('current', lambda i: m.at('motor').torque * law(i / m.current))


@mechanism('motor')
def torque_constant_error(a, m, d, curve):
    """
    Magnets that give less than the data sheet says, by a share of 1 - exp(-amount).

    demagnetised: the torque; Ruoho, Dlala, Arkkio, IEEE Trans. Magn. 43 (2007)
    warming: the torque, by 1 - exp(-t / 0.2 to 0.5); Sebastian, IEEE Trans. Ind. Appl. 31 (1995)
    one_way: the torque of positive current; a phase short of turns, Nandi, Toliyat, IEEE TEC 20
    """
    lost, fades = 1 - np.exp(-a), d.uniform(0.2, 0.5) * m.seconds
    if curve == 'warming':
        return m.adds('motor_torque', _of_current(m, lambda i: -i), m.by(
            'time', lambda t: lost * (1 - np.exp(-t / fades))))
    return m.adds('motor_torque', _of_current(
        m, lambda i: -lost * (np.maximum(i, 0) if curve == 'one_way' else i)))


@mechanism('motor')
def torque_saturation(a, m, d, curve):
    """
    Torque that falls behind the current.

    froehlich: I / (1 + amount |I|); Froelich, ETZ 2 (1881)
    cubic: I - amount I^3 up to its top; any series of a magnetisation curve
    knee: past 0.5 I the slope is exp(-amount); Melkebeek, Electrical Machines and Drives (2018)
    """
    def cubic(i):
        top = np.clip(i, -1, 1) / np.sqrt(3 * a) if 3 * a > 1e9 else np.clip(
            i, -1 / np.sqrt(3 * a), 1 / np.sqrt(3 * a))
        return top - a * top**3
    shape = {'froehlich': lambda i: i / (1 + a * np.abs(i)), 'cubic': cubic,
             'knee': lambda i: i - (1 - np.exp(-a)) * (i - np.clip(i, -0.5, 0.5))}[curve]
    return m.adds('motor_torque', _of_current(m, lambda i: shape(i) - i))


@mechanism('load')
def gravity(a, m, d, curve):
    """
    Weight on a lever.

    lever: sin(q + p0); any textbook of mechanics
    parallelogram: sin(q + p0) + 0.5 sin(2 q); two links that turn together, Spong et al. (2006)
    balanced: sin r (1 - 1.2 / sqrt(2.2 - 2 cos r)), r = q + p0; a spring that balances too much,
      Herder, Energy-free Systems, TU Delft (2001)
    """
    phase = d.uniform(-1.2, 1.2)
    shape = {'lever': np.sin, 'parallelogram': lambda r: np.sin(r) + 0.5 * np.sin(2 * (r - phase)),
             'balanced': lambda r: 2 * np.sin(r) * (1 - 1.2 / np.sqrt(2.2 - 2 * np.cos(r)))}[curve]
    return m.adds('load_torque', m.turn(lambda q: -a * m.torque * shape(q + phase)))


@mechanism('load')
def spring_load(a, m, d, curve):
    """
    A spring between load and frame; y is q over the travel.

    torsion: y; Hooke, De Potentia Restitutiva (1678)
    hoses: y + 3 y^3, a dress pack; Duffing, Erzwungene Schwingungen (1918)
    slack: what |y| is beyond 0.3; a cable that comes tight
    preloaded: 0.6 + y; a spring that returns a valve, Deur et al., IEEE Trans. Ind. Appl. 40
    """
    way = m.way
    shape = {'torsion': lambda y: y, 'hoses': lambda y: y + 3 * y**3,
             'slack': lambda y: 2 * (y - np.clip(y, -0.3, 0.3)),
             'preloaded': lambda y: 0.6 * way + y}[curve]
    return m.adds('load_torque', m.by('load_angle', lambda q: -a * m.torque * shape(q / m.travel)))


@mechanism('load')
def payload_resonance(a, m, d, curve):
    """
    A part of the load on a spring, (1 - exp(-amount)) of its inertia; b is how far it bends.

    linear: b; Den Hartog, Mechanical Vibrations (1934)
    swinging: sin(1.5 b) / 1.5 over its scale; Ibrahim, Liquid Sloshing Dynamics (2005)
    hardening: b + 4 b^3 over its scale; Duffing, Erzwungene Schwingungen (1918)
    dry: b and dry friction; Den Hartog, Trans. ASME 53 (1931)
    """
    share, frequency = 0.8 * (1 - np.exp(-a)), d.uniform(*m.hung)
    inertia = share * m.plant.load_inertia
    bend = m.torque / m.plant.load_inertia / (2 * np.pi * frequency)**2
    kind, shape = {'linear': (LINEAR, 0.0), 'swinging': (SWINGING, 1.5 / bend),
                   'hardening': (HARDENING, 4 / bend**2),
                   'dry': (DRY, 0.05 * share * m.torque)}[curve]
    return Change({'load_inertia': m.plant.load_inertia - inertia, 'hung_inertia': inertia,
                   'hung_kind': kind, 'hung_frequency': frequency, 'hung_shape': shape,
                   'hung_damping': d.uniform(0.01, 0.05)})


def _inertia(a, m, d, curve, name):
    """Return the change of an inertia by exp(+-amount), over the turn or from a time on."""
    now = getattr(m.plant, name)
    more = np.expm1(a * m.way) * now
    if curve == 'crank':
        phase = d.uniform(0, 6)
        return m.adds(name, m.turn(lambda p: (1 - np.exp(-a)) * now * np.cos(p + phase), 2.0))
    if curve == 'picked_up':
        since = d.uniform(0.2, 0.4) * m.seconds
        return m.adds(name, m.by('time', lambda t: abs(more) * np.clip(
            4 * (t - since) / m.seconds, 0, 1)))
    return Change({name: now + more})


@mechanism('motor', name='parameter:rotor_inertia')
def rotor_inertia(a, m, d, curve):
    """
    Inertia on the motor that the data sheet does not have.

    constant: by exp(+-amount); a brake or a disc, any data sheet
    crank: by cos 2p; Wilson, Sadler, Kinematics and Dynamics of Machinery (1991)
    film: of a ring that a film drags along within 3 to 10 ms; Houdaille damper, Den Hartog (1934)
    """
    if curve == 'film':
        return Change({'ring_inertia': a * m.plant.rotor_inertia,
                       'ring_time': d.uniform(0.003, 0.01)})
    return _inertia(a, m, d, curve, 'rotor_inertia')


@mechanism('load', name='parameter:load_inertia')
def load_inertia(a, m, d, curve):
    """
    Inertia on the load that the data sheet does not have.

    constant: by exp(+-amount); another payload, any data sheet
    crank: by cos 2p; Wilson, Sadler, Kinematics and Dynamics of Machinery (1991)
    picked_up: from 0.2 to 0.4 of the recording on; Khalil, Dombre, Robots, ch. 12 (2002)
    """
    return _inertia(a, m, d, curve, 'load_inertia')
