r"""
The screw, its nut and the ways, as they are and not as a model has them.

The nut sits between two of the screw's three nodes. What the angle there, the errors of the pitch,
the screw's give along and its warmth leave between screw and table presses the balls,

.. math:: F = C\,(|\delta| - b/2)_+^{3/2}\,(1 + c\,\dot\delta)\,\mathrm{sgn}\,\delta

(Hertz 1882; Hunt and Crossley 1975). All dry friction is by elements that slip one by one. That of
the ways depends on place, temperature and the age of its contacts, and their grease thins as
Eyring's fluid.
"""

from __future__ import annotations

from math import asinh, cos, exp, log1p, pi, sin, sqrt

import numba as nb

from ..slip_elements import slide

_slide = slide
SHARES = (0.4, 0.35, 0.25)
REACHES = (0.35, 0.9, 1.8)
TURNING_REACH = 4e-3  # rad, of the bristles of what turns
RENEWAL = 8e-6  # m of sliding that renews a contact


@nb.njit
def pitch_error(P, angle):
    """Return by how much the nut is ahead of a perfect screw (m), and its slope, m/rad."""
    if P.screw_pitch == 0.0:
        return 0.0, 0.0
    way = angle / P.machine_ratio
    wave = 2.0 * pi / P.screw_pitch_length
    error = (P.screw_pitch_slope * way + P.screw_pitch_wave * (sin(wave * way + 0.8) - sin(0.8))
             + P.screw_wobble * (sin(angle + 1.1) - sin(1.1)))
    slope = (P.screw_pitch_slope + P.screw_pitch_wave * wave * cos(wave * way + 0.8)
             ) / P.machine_ratio + P.screw_wobble * cos(angle + 1.1)
    return P.screw_pitch * error, P.screw_pitch * slope


@nb.njit
def press(P, gap, rate):
    """Return the force of the balls on the table, N, at a gap between screw and table, m."""
    over = abs(gap) - 0.5 * P.nut_play
    if over <= 0.0:
        return 0.0
    way = 1.0 if gap > 0.0 else -1.0
    return way * P.nut_hertz * over * sqrt(over) * max(0.0, 1.0 + P.nut_damping * rate * way)


@nb.njit
def ways_budget(P, S):
    """Return what the ways can resist with, N."""
    level = P.ways_dry * P.ways_friction
    level *= exp(-0.008 * P.ways_temperature * (S.temperature - 20.0))
    level *= 1.0 + 0.07 * P.ways_weakening * log1p(P.ways_fade * S.age)
    far = S.table / 0.05
    bump = 0.15 * exp(-(far - 0.9) ** 2) - 0.1 * exp(-0.5 * (far + 1.1) ** 2)
    return level * max(0.0, 1.0 + P.ways_place * bump)


@nb.njit
def thinned(P, speed):
    """Return the viscous force of the ways, N."""
    return P.ways_viscous * P.ways_thinning * asinh(speed / P.ways_thinning)


@nb.njit
def nut_place(P, S):
    """Return the node before the nut and how far behind it the nut is, as a share of a part."""
    at = min(max((P.screw_place + S.table) / P.screw_span, 0.0), 0.999999) * 2.0
    node = int(at)
    return node, at - node


@nb.njit
def mechanics(P, S, torque, h):
    """Step all bodies by h under the motor's torque, N m: forces from places, then speeds."""
    rotor = P.machine_rotor_inertia + 0.5 * P.machine_coupling_inertia
    node, share = nut_place(P, S)
    angle = (1.0 - share) * S.angles[node] + share * S.angles[node + 1]
    speed = (1.0 - share) * S.speeds[node] + share * S.speeds[node + 1]

    # between screw and table
    error, slope = pitch_error(P, angle)
    place = P.screw_place + S.table
    warm = P.screw_expansion * ((S.temperature - S.first_temperature) * P.screw_place
                                + (S.temperature - P.thermal_room) * S.table)
    given = place * (P.screw_span - place) / (P.screw_stretch * P.screw_span)
    S.stretch += 0.5 * (S.force * given - S.stretch)
    gap = angle / P.machine_ratio + error + warm + S.along - S.stretch - S.table
    advance = speed * (1.0 / P.machine_ratio + slope)
    force = press(P, gap, advance + S.along_speed - S.table_speed)
    S.force = force

    # what turns
    critical = 2.0 * P.screw_damping
    coupling = P.screw_coupling_stiffness
    on_coupling = (coupling * (S.motor_angle - S.angles[0])
                   + critical * sqrt(coupling * rotor) * (S.motor_speed - S.speeds[0]))
    drag, held = _slide(S.bearing_bristles, SHARES, REACHES, h * S.motor_speed,
                        P.nut_bearing_drag, TURNING_REACH)
    drag += P.nut_viscous * S.motor_speed + 0.2 * sqrt(held * rotor) * S.motor_speed
    loss = P.nut_drag + P.nut_loss * abs(force) / P.machine_ratio
    rubbed, held = _slide(S.nut_bristles, SHARES, REACHES, h * speed, loss, TURNING_REACH)
    rubbed += 0.2 * sqrt(held * 0.5 * P.machine_screw_inertia) * speed
    on_nut = force * (1.0 / P.machine_ratio + slope) + rubbed
    part = 2.0 * P.screw_torsion / P.screw_span
    inertia = 0.25 * P.machine_screw_inertia
    between = critical * sqrt(part * inertia)
    near = part * (S.angles[0] - S.angles[1]) + between * (S.speeds[0] - S.speeds[1])
    far = part * (S.angles[1] - S.angles[2]) + between * (S.speeds[1] - S.speeds[2])
    S.motor_speed += h * (torque - on_coupling - drag) / rotor
    first = inertia + 0.5 * P.machine_coupling_inertia
    S.speeds[0] += h * (on_coupling - near) / first
    S.speeds[1] += h * (near - far) / (2.0 * inertia)
    S.speeds[2] += h * far / inertia
    mass = first if node == 0 else 2.0 * inertia
    S.speeds[node] -= h * (1.0 - share) * on_nut / mass
    mass = 2.0 * inertia if node == 0 else inertia
    S.speeds[node + 1] -= h * share * on_nut / mass

    # what slides
    hold = (P.screw_bearing * S.along
            + critical * sqrt(P.screw_bearing * P.machine_screw_mass) * S.along_speed)
    S.along_speed -= h * (hold + force) / P.machine_screw_mass
    dry, held = _slide(S.ways_bristles, SHARES, REACHES, h * S.table_speed, ways_budget(P, S),
                       P.ways_reach)
    wet = thinned(P, S.table_speed) + 0.2 * sqrt(held * P.machine_table_mass) * S.table_speed
    S.table_speed += h * (force - dry - wet - S.external) / P.machine_table_mass

    S.motor_angle += h * S.motor_speed
    for k in range(len(S.angles)):
        S.angles[k] += h * S.speeds[k]
    S.along += h * S.along_speed
    S.table += h * S.table_speed
    return abs(rubbed * speed) + 0.3 * abs((dry + wet) * S.table_speed)


@nb.njit
def surroundings(P, S, heat, h):
    """Step what is slow: cutting force, warmth, the age of the contacts of the ways."""
    S.external += (S.external_target - S.external) * (
        min(1.0, h / P.load_lag) if P.load_lag > 0.0 else 1.0)
    S.temperature += h / P.thermal_capacity * (
        P.thermal_heating * heat - P.thermal_cooling * (S.temperature - P.thermal_room))
    speed = abs(S.table_speed)
    rate = speed / RENEWAL
    if rate * h > 1e-9:
        S.age = 1.0 / speed + (S.age - 1.0 / speed) * exp(-rate * h)
    else:
        S.age += h / RENEWAL
    S.age = min(S.age, 1e5)
