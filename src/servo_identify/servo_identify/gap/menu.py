"""Recordings that the rig could make, as the augmented twin would make them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS, OUTPUTS
from servo_twin.recording.recording import Recording

from .balance import Balance
from .observation import observe
from .stack import Stack

DURATION = 10.0  # s of each recording of the menu: what separates most does so per second too
BEYOND = 1.2  # times the largest travel, speed and torque seen that a recording may reach


def recordings_of_the_menu(evidence) -> Iterator[tuple[str, dict, Stack]]:
    """Yield (family, settings, residuals) of the recordings of the menu that can be made."""
    extended = evidence.stacks['screen'].extended
    seen_so_far = _reach([one.seen.recording for one in evidence.stacks['screen'].balances])
    for family, settings in _menu(evidence, seen_so_far[0]):
        recording = _simulated(evidence.augmented, family, settings, evidence)
        if recording is None:
            continue
        if np.any(_reach([recording]) > BEYOND * seen_so_far):
            continue
        seen = observe([recording], evidence.servo)[0]
        more = Stack([Balance(extended.servo, seen, extended.given, extended.theta)], extended)
        if len(more.base):
            yield family, settings, more


def _reach(recordings: list[Recording]) -> np.ndarray:
    """
    Return the largest travel, rad, speed, rad/s, and torque, N m, of recordings.

    The torque is 0 where it is not measured. Travel counts for the stops that a rig may have, and
    for the laws that hold within it.
    """
    reached = np.zeros(3)
    for one in recordings:
        name = 'load_position' if one.has('load_position') else 'motor_position'
        step = max(1, round(0.02 / one.period))
        way = one[name][step:] - one[name][:-step]
        reached = np.maximum(reached, (
            np.nanmax(one[name]) - np.nanmin(one[name]),
            np.nanmax(np.abs(way), initial=0.0) / (step * one.period),
            np.nanmax(np.abs(one['torque'])) if one.has('torque') else 0.0))
    return reached


def _menu(evidence, travel: float) -> list[tuple[str, dict]]:
    """Recordings within what the rig was seen to do; ``travel`` is how far, rad."""
    balances = evidence.stacks['screen'].balances
    speed = max(float(np.nanpercentile(np.abs(b.motion('load_speed')), 99)) for b in balances)
    volts = max(float(np.percentile(np.abs(b.seen.voltage), 99)) for b in balances)
    load = max(float(np.max(np.abs(b.seen.external))) for b in balances)
    menu: list[tuple[str, dict]] = []
    if evidence.servo.controller.parameters:
        rise = {'acceleration': _acceleration(balances, speed)}

        def within(share: float, seconds: float) -> float:
            return min(share * speed, travel / seconds)

        top = within(1.0, DURATION / 8)
        ladder = np.geomspace(0.05 * top, top, 4).tolist()
        menu += [('speed_ladder', {'speeds': ladder, **rise}),
                 ('slow_reversals', {'speed': 0.02 * speed, 'period': 2.5}),
                 ('slow_reversals', {'speed': 0.1 * speed, 'period': 2.5}),
                 ('slow_reversals', {'speed': 0.5 * speed, 'period': 2.5})]
        menu += [('turns', {'speed': within(share, DURATION / 2 - 0.5), **rise})
                 for share in (0.2, 1.0)]
        if load > 0.0:
            menu += [('load_steps', {'speed': within(share, 4.0), 'torque': part * load, **rise})
                     for share, part in ((0.3, 1.0), (0.03, 1.0), (0.03, 0.3))]
    menu += [('chirp', {'amplitude': share * volts, 'from': 0.5, 'to': 15.0})
             for share in (0.7, 0.25)]
    menu += [('multisine', {'amplitude': share * volts, 'from': 0.5, 'to': 10.0, 'lines': 8})
             for share in (0.9, 0.3)]
    menu += [('sine', {'amplitude': 0.8 * volts, 'frequency': 0.5}),
             ('sine', {'amplitude': 0.4 * volts, 'frequency': 2.0})]
    return menu


def _acceleration(balances: list[Balance], speed: float) -> float:
    """Return the largest acceleration that was asked for, rad/s2: what the rig is known to do."""
    asked = 0.0
    for one in balances:
        reference = one.seen.column('reference_velocity', np.nan)
        steps = np.abs(np.diff(reference))
        asked = max(asked, float(np.max(steps[np.isfinite(steps)], initial=0.0)) / one.seen.period)
    return asked if asked > 0.0 else 10.0 * speed


def _simulated(servo: Servo, family: str, settings: dict, evidence) -> Recording | None:
    period = evidence.stacks['screen'].balances[0].seen.period
    samples = int(DURATION / period)
    t = np.arange(samples) * period
    columns = {name: np.full(samples, np.nan) for name in INPUTS}
    mode = 'measured_input' if 'amplitude' in settings else 'closed_loop'
    reference, columns['external_torque'] = _waves(family, settings, t)
    if mode == 'closed_loop':
        columns['reference_velocity'] = reference
        columns['reference_position'] = np.cumsum(reference) * period
    else:
        columns['voltage'] = reference
    y = simulate(servo, inputs_of(columns), period, initial_state(servo), mode)
    if not np.isfinite(y).all():
        return None
    answer = dict(zip(OUTPUTS, y.T.copy(), strict=True))
    measured = {'voltage': answer['voltage'], 'external_torque': columns['external_torque']}
    if mode == 'closed_loop':
        measured['reference_velocity'] = columns['reference_velocity']
        measured['reference_position'] = columns['reference_position']
    seen = evidence.stacks['screen'].balances[0].seen
    chance = np.random.default_rng(1)
    for channel in ('motor_position', 'load_position', 'torque', 'current'):
        if seen.recording.has(channel):
            measured[channel] = answer[channel] + chance.normal(0.0, seen.noise[channel], samples)
    return Recording(family, period, measured, family=family)


def _waves(family: str, settings: dict, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return reference (V, or rad/s at the load) and external torque, N m, shape of t each."""
    still = np.zeros(len(t))
    if family == 'slow_reversals':
        phase = 2.0 * np.pi * t / settings['period']
        return settings['speed'] * 2.0 / np.pi * np.arcsin(np.sin(phase)), still
    if family == 'sine':
        return settings['amplitude'] * np.sin(2.0 * np.pi * settings['frequency'] * t), still
    if family == 'chirp':
        rate = np.log(settings['to'] / settings['from']) / DURATION
        turns = settings['from'] * np.expm1(rate * t) / rate
        return settings['amplitude'] * np.sin(2.0 * np.pi * turns), still
    if family == 'multisine':
        tones = np.geomspace(settings['from'], settings['to'], settings['lines'])
        wave = sum(np.sin(2.0 * np.pi * f * t + 1.7 * i * i) for i, f in enumerate(tones))
        return settings['amplitude'] * wave / np.abs(wave).max(), still
    speed, torque = still, still
    if family == 'speed_ladder':
        levels = np.repeat(settings['speeds'], 2)
        place = (t / DURATION * len(levels)).astype(int)
        speed = levels[place] * np.where(place % 2, -1.0, 1.0)
    elif family == 'turns':
        way = np.where(t < DURATION / 2, 1.0, -1.0)
        speed = settings['speed'] * np.where(t % (DURATION / 2) < DURATION / 2 - 0.5, way, 0.0)
    elif family == 'load_steps':
        levels = np.linspace(-1.0, 1.0, 5)
        cycle = np.concatenate((levels, levels[-2:0:-1]))
        place = (t / 0.5).astype(int)
        speed = settings['speed'] * np.where(place // len(cycle) % 2, -1.0, 1.0)
        torque = settings['torque'] * cycle[place % len(cycle)]
    return _eased(speed, settings['acceleration'] * (t[1] - t[0])), torque


def _eased(wanted: np.ndarray, most: float) -> np.ndarray:
    """Return a speed that follows another one from rest, by ``most`` from sample to sample."""
    eased, now = np.empty(len(wanted)), 0.0
    for i, speed in enumerate(wanted):
        now += min(max(speed - now, -most), most)
        eased[i] = now
    return eased
