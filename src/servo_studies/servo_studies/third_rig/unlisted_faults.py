"""
Faults that no catalogue of servo models has, with the torque balance and variables they are of.

The letters are those of the other faults.
"""

from __future__ import annotations

import numpy as np

from .fault_terms import Change, mechanism, Term


@mechanism('load', balance='load', variables='load_speed temperature', needs='temperature')
def eddy_brake(a, m, d, curve):
    """
    A brake whose torque has a top over speed and falls as its disc warms.

    disc: 2 s / (1 + s^2) exp(-W), s is x over 0.3; Wouterse, IEE Proc. B 138 (1991)
    """
    warm = d.uniform(10, 20)
    return m.resists(2 * a, m.by('temperature_rise', lambda w: np.exp(-w / warm)),
                     speed=lambda x: 2 * (x / 0.3) / (1 + (x / 0.3)**2))


@mechanism('load', balance='load', variables='load_angle time')
def cable_snag(a, m, d, curve):
    """
    A cable that drags within a part of the stroke, at times.

    telegraph: one or nothing by chance, for 0.05 to 0.2 of the recording each
    """
    edges = np.cumsum(d.uniform(0.05, 0.2, 60)) * m.seconds
    centre, width = d.uniform(-0.4, 0.4) * m.travel, 0.4 * m.travel
    return m.resists(2 * a, m.by('time', lambda t: np.searchsorted(edges, t) % 2 * 1.0), m.by(
        'load_angle', lambda q: np.clip(2 - abs(q - centre) / width, 0, 1)))


@mechanism('load', balance='load', variables='time')
def base_motion(a, m, d, curve):
    """
    A base that another axis shakes.

    three_tones: sines of 0.5 to 8 Hz, in no simple relation
    """
    f, phase = d.uniform(0.5, 8.0, 3), d.uniform(0, 6, 3)
    tones = [Term('load_torque', (_clock(m, lambda t, i=i: a * m.torque * np.sin(
        2 * np.pi * f[i] * t + phase[i]), 1 / f[i]),)) for i in range(3)]
    return Change(terms=tuple(tones))


def _clock(m, law, period):
    """Return a curve of time that repeats."""
    name, table = m.by('time', law)
    return name, table.__class__(law, 0.0, period, wraps=True)


@mechanism('drive', balance='drive', variables='command current', needs='voltage_drive')
def supply_sag(a, m, d, curve):
    """
    A supply that gives way under the current that all its axes draw.

    inner_resistance: the command times 1 - amount |I| / (1 + amount |I|)
    """
    return m.adds('command', m.by('command', lambda u: -u), m.by(
        'current', lambda i: 1 - 1 / (1 + a * abs(i / m.current))))


@mechanism('drive', balance='drive', variables='command motor_speed')
def regeneration_limit(a, m, d, curve):
    """
    A drive that gives less while it brakes, as its supply takes no power back.

    share: 1 - exp(-amount) of a command against the motion is lost
    """
    lost = 1 - np.exp(-a)

    def against(way):
        return Term('command', (
            m.by('command', lambda u: -lost * np.where(u * way > 0, u, 0.0)),
            m.by('motor_rate', lambda v: np.clip(-20 * v * way / m.plant.ratio / m.load_speed,
                                                 0, 1))))
    return Change(terms=(against(1.0), against(-1.0)))


@mechanism('mesh', balance='transmission', variables='torque', needs='compliant load')
def slipping_coupling(a, m, d, curve):
    """
    A coupling between gear and load that slips, and does not come back.

    creep: beyond 1 / (1 + amount) of rated torque, as fast as what is beyond
    """
    return Change({'clutch': m.load_torque / (1 + a),
                   'clutch_drag': 50 * m.load_torque / m.load_speed})


@mechanism('load_position motor_position', balance='sensor', variables='angle')
def bad_stripe(a, m, d, curve):
    """
    A scratch on the disc of an encoder: a reading that jumps within a few degrees.

    scratch: amount of a hundredth of the travel, up and down
    """
    shaft = m.site.removesuffix('_position')
    centre, size = d.uniform(1.0, 5.0), a * 0.01 * m.travel * m.at(shaft).turns
    size /= m.at(shaft).turns**0.5
    return m.adds(f'{shaft}_reading', m.at(shaft).turn(lambda q: size * np.where(
        abs(q - centre) < 0.12, np.sign(q - centre) + 0.5, 0.0)))


@mechanism('load', balance='load', variables='load_speed time')
def rest_friction(a, m, d, curve):
    """
    Friction that grows with the logarithm of the time at rest, until some sliding ends it.

    rate_and_state: ln(1 + rest / 10 ms); Dieterich, JGR 84 (1979), Ruina, JGR 88 (1983)
    """
    return Change({'rest_travel': 0.02 * m.travel}) + m.resists(
        a, m.by('rest', lambda s: np.log1p(s / 0.01) / 3))


@mechanism('load', balance='load', variables='load_angle load_speed')
def knocking_bearing(a, m, d, curve):
    """
    A loose bearing that knocks as one angle passes, the harder the faster.

    knock: x times two swings of a sine within 0.4 rad
    """
    centre = d.uniform(-0.4, 0.4) * min(m.travel, np.pi)

    def window(q):
        near = (q - centre + np.pi) % (2 * np.pi) - np.pi
        return np.where(abs(near) < 0.2, np.sin(2 * np.pi * near / 0.2), 0.0)
    return m.adds('load_torque', m.turn(window), m.by(
        'load_speed', lambda v: 4 * a * m.torque * v / m.load_speed))
