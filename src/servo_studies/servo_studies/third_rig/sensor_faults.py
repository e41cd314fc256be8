"""
What sensors, and the loop that reads them, do besides, in the curves of their literature.

q is the angle of the load, t the time over that of a recording.
"""

from __future__ import annotations

import numpy as np

from .drive_faults import FAST
from .fault_terms import Change, Inapplicable, mechanism
from .plant import CONSTANT, FIRST_ORDER, MEAN, POSITION_LOOP, SPEED_PI


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
