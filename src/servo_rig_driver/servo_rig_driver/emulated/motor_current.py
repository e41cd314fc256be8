"""The drive's current and the torque that the motor makes of it."""

from math import cos, exp, pi, sin

import numba as nb

from .rig_state import RING

LATENCY = 60e-6  # s


@nb.njit
def delayed(ring, at, back):
    """Return the value of a ring ``back`` substeps ago, interpolated between two of them."""
    back = min(max(back, 0.0), RING - 2.0)
    whole = int(back)
    part = back - whole
    new = ring[(at - whole) % RING]
    return new if part == 0.0 else new + part * (ring[(at - whole - 1) % RING] - new)


@nb.njit
def command_at_drive(P, S, h):
    """Return the command that the current loop works on, V."""
    dead = LATENCY * P.drive_latency + P.withheld_command_delay
    back = round(dead / h) - 1  # the newest entry of the ring is that of the substep before
    u = S.command if back < 0 else delayed(S.commands, S.at, float(back))
    u += P.withheld_drive_offset
    band = P.withheld_drive_dead_band
    if band > 0.0:
        ratio = (u / band) ** 6
        u *= ratio / (1.0 + ratio)
    return u


@nb.njit
def advance_current(P, S, h):
    """Step the winding by h, exactly where command and speed stand still meanwhile."""
    u = command_at_drive(P, S, h)
    emf = P.machine_torque_constant * S.motor_speed
    supply = max(0.0, P.drive_supply - P.withheld_supply_sag * abs(S.current))
    inductance = P.drive_inductance * P.drive_current_lag
    if P.drive_current_loop > 0.5:
        wanted = P.drive_gain * (1.0 + P.withheld_drive_gain) * u
        wanted = min(max(wanted, -P.drive_current_limit), P.drive_current_limit)
        if inductance < 1e-9:
            S.current = wanted
            return
        corner = 2.0 * pi * P.drive_bandwidth / P.drive_current_lag
        error = wanted - S.current
        volts = corner * inductance * error + S.current_integral
        if abs(volts) < supply:
            S.current_integral += (P.drive_current_integral * corner * P.drive_resistance
                                   * error * h)
            rate = corner + P.drive_resistance / inductance
            goal = (corner * wanted + (S.current_integral - emf) / inductance) / rate
            S.current = goal + (S.current - goal) * exp(-rate * h)
            return
        volts = min(max(volts, -supply), supply)
    else:
        gained = u * (1.0 + P.withheld_drive_gain)
        volts = min(max(gained, -supply), supply)
    goal = (volts - emf) / P.drive_resistance
    if inductance < 1e-9:
        S.current = goal
    else:
        S.current = goal + (S.current - goal) * exp(-h * P.drive_resistance / inductance)


@nb.njit
def motor_torque(P, S):
    """Return the torque of the magnets on the rotor, N m."""
    constant = P.machine_torque_constant * (1.0 + P.withheld_torque_constant)
    knee = abs(S.current) * P.withheld_torque_saturation
    if knee > 0.0:
        constant *= (1.0 + knee ** 3) ** (-1.0 / 3.0)
    torque = constant * S.current
    turns = P.motor_order * S.motor_angle
    swing = 0.006 * P.motor_ripple + P.withheld_torque_ripple
    if swing > 0.0:
        torque *= 1.0 + swing * cos(turns + 0.9)
    if P.motor_cogging > 0.0:
        s = sin(turns)
        torque += P.motor_cogging * P.motor_cogging_torque * s * (1.0 + 0.6 * cos(turns))
    if P.withheld_cogging > 0.0:
        torque += P.withheld_cogging * sin(0.5 * turns + 0.3)
    return torque
