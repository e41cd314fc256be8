"""What the residual of a balance is small against: noise, doubt, and its largest term."""

from __future__ import annotations

import numpy as np

from .balance import Balance
from .mesh_zero import kinks
from .unseen_mesh import swing


def noise_floor(one: Balance, name: str, theta: np.ndarray) -> float:
    """Standard deviation of a balance's residual by the noise of the readings alone."""
    noise = {k: 0.0 if np.isnan(v) else v for k, v in one.seen.noise.items()}
    value, bump = one.value, one.bump_of(name)
    plain, twice = bump.gain(0), bump.gain(2)
    ratio = value(theta, 'mechanism.ratio')
    gain = value(theta, 'drive.torque_constant')
    rotor = value(theta, 'mechanism.rotor_inertia')
    inertia = value(theta, 'mechanism.load_inertia')
    motor_noise, load_noise = noise['motor_position'], noise['load_position']
    if not one.seen.has('load'):
        load_noise = motor_noise / ratio
    if not one.seen.has('motor'):
        motor_noise = load_noise * ratio
    current = noise['current'] * gain * plain
    torque = noise['torque'] * plain
    by_motor, by_load = rotor * motor_noise * twice, inertia * load_noise * twice
    stiffness = value(theta, 'mechanism.stiffness')
    if name == 'drive':
        back = value(theta, 'drive.back_emf') / (value(theta, 'drive.resistance') or 1.0)
        return float(np.hypot(noise['current'] * plain, back * motor_noise * bump.gain(1)))
    if name == 'controller':
        return one.command_noise(theta)
    if name == 'motor':
        return float(np.hypot.reduce((current, torque / ratio, by_motor)))
    if name == 'load':
        return float(np.hypot(torque, by_load))
    if name == 'torque':
        return float(np.hypot.reduce((ratio * current, ratio * by_motor, by_load)))
    angles = np.hypot(motor_noise / ratio, load_noise) * plain
    if not stiffness:
        return float(angles)
    return float(np.hypot(angles, (torque if one.seen.has('torque') else by_load) / stiffness))


def doubt_about(one: Balance, name: str) -> np.ndarray:
    """
    Uncertainty at each centre that is no noise: rounding to counts, kinks within the bump, what a
    mesh does that no second encoder sees.

    A shaft that passes many counts under the bump averages them; one that creeps does not, and
    its error is no noise that a longer recording would reduce.
    """
    size = np.zeros(len(one.times(name)))
    if name in ('torque', 'motor', 'load'):
        return swing(one, name)
    if name != 'transmission':
        return size
    size = size + kinks(one)
    seen, bump = one.seen, one.seen.mesh
    ratio = one.servo.values['mechanism.ratio']
    for count, speed in ((seen.counts['motor_position'] / ratio,
                          one.weighed('motor_speed', name) / ratio),
                         (seen.counts['load_position'], one.weighed('load_speed', name))):
        if count > 0.0:
            passed = np.abs(speed) * 2.5 * bump.spacing * bump.period / count
            size = np.hypot(size, count / np.sqrt(12.0) / (1.0 + np.nan_to_num(passed)**2))
    return size


def signal_of(one: Balance, name: str, theta: np.ndarray) -> float:
    """Root mean square of the largest term of a balance: what the residual is small against."""
    seen = one.seen

    def size(x):
        x = x[np.isfinite(x)]
        return float(np.sqrt(np.mean(x**2))) if len(x) else 0.0

    gain, ratio = one.value(theta, 'drive.torque_constant'), one.value(theta, 'mechanism.ratio')
    if name == 'drive':
        return size(seen.channels.current)
    if name == 'controller':
        return size(seen.recording['voltage'])
    if name in ('motor', 'torque'):
        current = seen.channels.current if seen.has('current') else one.model_current(
            theta, one.base_switches)
        return size(current) * gain * (ratio if name == 'torque' else 1.0)
    if name == 'load':
        return size(seen.channels.torque)
    wind_up = one.motion('wind_up')
    return size(wind_up - np.mean(wind_up))

