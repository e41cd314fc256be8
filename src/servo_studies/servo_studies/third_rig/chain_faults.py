"""
What drive, gear, sensors and loop do besides, in the curves of their literature.

u is the command over that of rated torque, c the twist that carries torque over that at rated
torque, T the torque over the rated one, q the angle of the load, t the time over that of a
recording.
"""

from __future__ import annotations

import numpy as np

from .fault_terms import Change, Elements, Inapplicable, mechanism
from .integrator import (
    CONSTANT,
    DAHL,
    FIRST_ORDER,
    MEAN,
    POSITION_LOOP,
    RELAXING,
    SECOND_ORDER,
    SLEW,
    SLIP_ELEMENTS,
    SPEED_PI,
)

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


@mechanism('load_position', needs='compliant load')
def load_encoder_eccentricity(a, m, d, curve):
    """
    A reading that is off by `amount` of the twist at rated torque over the turn.

    centre: sin(q + q0); Heidenhain, Angle Encoders
    tilted: sin(q + q0) + 0.4 sin 2q; Ellin, Dolsak, Sensor Review 28 (2008)
    oval: sin(2q + q0), what two heads leave; Lu, Trumper, CIRP Annals 56 (2007)
    """
    q0, size = d.uniform(0, 2 * np.pi), a * m.twist
    shape = {'centre': lambda q: np.sin(q + q0), 'oval': lambda q: np.sin(2 * q + q0),
             'tilted': lambda q: np.sin(q + q0) + 0.4 * np.sin(2 * q)}[curve]
    return m.adds('load_reading', m.at('load').turn(lambda q: size * shape(q)))


@mechanism('load_position motor_position torque')
def sensor_delay(a, m, d, curve):
    """
    A reading that is amount / 100 s old.

    constant: a serial encoder; Åström, Wittenmark, Computer-Controlled Systems (1997)
    filter: of first order; an amplifier of strain gauges, Doebelin, Measurement Systems (2003)
    mean: over twice that; a converter that averages, Oppenheim, Schafer (2009)
    """
    short = {'load_position': 'load', 'motor_position': 'motor', 'torque': 'torque'}[m.site]
    kind, late = {'constant': (CONSTANT, 1), 'filter': (FIRST_ORDER, 1), 'mean': (MEAN, 2)}[curve]
    return Change({f'{short}_late_kind': kind, f'{short}_late': late * a * FAST})


def _gain_error(a, m, d, curve, variable, rated):
    """Return the reading of a channel that is off in proportion to what it reads."""
    more, fades = m.way * (1 - np.exp(-a)), d.uniform(0.2, 0.5) * m.seconds
    law = {'constant': lambda y: more * y, 'one_sided': lambda y: more * np.maximum(y, 0),
           'creeping': lambda y: more * y,
           'compressed': lambda y: -abs(more) * y * np.minimum((y / rated)**2, 1)}[curve]
    time = (m.by('time', lambda t: 1 - np.exp(-t / fades)),) if curve == 'creeping' else ()
    return m.adds(f'{variable}_reading', m.by(variable, law), *time)


def _zero_error(a, m, d, curve, variable, rated):
    """Return the reading of a channel that is off at zero."""
    size, fades = a * rated * m.way, d.uniform(0.1, 0.4) * m.seconds
    shape = {'constant': lambda t: 1.0 + 0 * t, 'ramp': lambda t: 2 * t / m.seconds,
             'warming': lambda t: 1 - np.exp(-t / fades)}[curve]
    return m.adds(f'{variable}_reading', m.by('time', lambda t: size * shape(t)))


@mechanism('torque', needs='torque')
def torque_sensor_gain(a, m, d, curve):
    """
    A torque sensor that reads more or less by a share s = 1 - exp(-amount).

    constant: at all; any data sheet
    one_sided: of positive torque; Doebelin, Measurement Systems (2003)
    creeping: by 1 - exp(-t / 0.2 to 0.5); creep of strain gauges, OIML R 60
    """
    return _gain_error(a, m, d, curve, 'torque', m.load_torque)


@mechanism('torque', needs='torque')
def torque_sensor_offset(a, m, d, curve):
    """
    A torque sensor that is off at zero.

    constant: 1; any data sheet
    ramp: 2 t; drift of an amplifier, Doebelin, Measurement Systems (2003)
    warming: 1 - exp(-t / 0.1 to 0.4); the same
    """
    return _zero_error(a, m, d, curve, 'torque', m.load_torque)


@mechanism('current', needs='current')
def current_sensor_gain(a, m, d, curve):
    """
    A current sensor that reads more or less by a share s = 1 - exp(-amount).

    constant: at all; Chung, Sul, IEEE Trans. Ind. Appl. 34 (1998)
    one_sided: of positive current; the same
    compressed: less by s I^3; a Hall core that saturates, Ramsden, Hall-Effect Sensors (2006)
    """
    return _gain_error(a, m, d, curve, 'current', m.current)


@mechanism('current', needs='current')
def current_sensor_offset(a, m, d, curve):
    """
    A current sensor that is off at zero.

    constant: 1; Chung, Sul, IEEE Trans. Ind. Appl. 34 (1998)
    ramp: 2 t; Ramsden, Hall-Effect Sensors (2006)
    warming: 1 - exp(-t / 0.1 to 0.4); the same
    """
    return _zero_error(a, m, d, curve, 'current', m.current)


@mechanism('controller', needs='closed')
def controller_mismatch(a, m, d, curve):
    """
    A loop that is set otherwise than its file says: by exp(+-amount).

    speed_gain: the gain of the speed loop; Åström, Hägglund, Advanced PID Control (2006)
    integral: its integral; the same
    position_gain: the gain of the position loop; the same
    filter: its speed filter, longer by amount / 100 s; the same
    """
    p, times = m.plant, np.exp(a * m.way)
    name = {'speed_gain': 'kv', 'integral': 'ki', 'position_gain': 'kp', 'filter': 'filter'}[curve]
    if name != 'filter' and not getattr(p, name) or name == 'kp' and p.controller == SPEED_PI:
        raise Inapplicable(f'its loop has no {name}')
    if name == 'filter' and p.controller == POSITION_LOOP and not p.kd:
        raise Inapplicable('its loop uses no speed')
    return Change({name: p.filter + a * FAST if name == 'filter' else getattr(p, name) * times})
