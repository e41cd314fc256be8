"""The recording that would separate two causes that these recordings cannot tell apart."""

from __future__ import annotations

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS, OUTPUTS
from servo_twin.recording import Recording

from .balance import Balance
from .candidates import Candidate
from .observation import observe
from .screening import Screening
from .stack import Stack

DURATION = 10.0  # s of each simulated recording of the menu


def next_experiment(evidence, screening: Screening, kept: list[int]) -> dict:
    """
    Return ``{separates, family, settings}``, empty where nothing is ambiguous.

    Each recording of a menu is simulated with the augmented twin under the noise of the rig; the
    best is the one in which the effect of one cause, at its fitted size, is least imitated by the
    other. ``settings`` are SI: amplitudes in V or rad/s at the load, frequencies in Hz.
    """
    pair = _pair(evidence.choices)
    if pair is None:
        return {}
    one, other = pair
    best = {}
    for family, settings in _menu(evidence):
        recording = _simulated(evidence.augmented, family, settings, evidence)
        if recording is None:
            continue
        told = _separation(recording, evidence, screening, one, other)
        if not best or told > best['_told']:
            best = {'separates': [one.name, other.name], 'family': family,
                    'settings': {**settings, 'duration': DURATION}, '_told': told}
    told = best.pop('_told', 0.0)
    if best:
        best['expected_ratio'] = told
    return best


def _pair(choices) -> tuple[Candidate, Candidate] | None:
    for choice in choices:
        for other in choice.ambiguous:
            if other.name != choice.candidate.name or other.site != choice.candidate.site:
                return choice.candidate, other
    return None


def _menu(evidence) -> list[tuple[str, dict]]:
    """Recordings within what the rig was seen to do."""
    balances = evidence.stacks['screen'].balances
    speed = max(float(np.nanpercentile(np.abs(b.motion('load_speed')), 99)) for b in balances)
    volts = max(float(np.percentile(np.abs(b.seen.voltage), 99)) for b in balances)
    load = max(float(np.max(np.abs(b.seen.external))) for b in balances)
    menu: list[tuple[str, dict]] = []
    if evidence.servo.controller.parameters:
        menu += [('speed_ladder', {'speeds': [share * speed for share in (0.05, 0.2, 0.5, 1.0)]}),
                 ('slow_reversals', {'speed': 0.05 * speed, 'period': 2.0}),
                 ('slow_reversals', {'speed': 0.3 * speed, 'period': 4.0}),
                 ('turns', {'speed': speed})]
        if load > 0.0:
            menu.append(('load_steps', {'speed': 0.3 * speed, 'torque': load}))
    menu += [('chirp', {'amplitude': 0.7 * volts, 'from': 0.5, 'to': 15.0}),
             ('multisine', {'amplitude': 0.7 * volts, 'frequencies': [0.5, 1.3, 2.9, 5.3, 9.7]}),
             ('sine', {'amplitude': 0.8 * volts, 'frequency': 0.5})]
    return menu


def _simulated(servo: Servo, family: str, settings: dict, evidence) -> Recording | None:
    period = evidence.stacks['screen'].balances[0].seen.period
    samples = int(DURATION / period)
    t = np.arange(samples) * period
    columns = {name: np.full(samples, np.nan) for name in INPUTS}
    columns['external_torque'] = np.zeros(samples)
    mode = 'measured_input' if 'amplitude' in settings else 'closed_loop'
    if mode == 'closed_loop':
        speed = np.zeros(samples)
        if family == 'speed_ladder':
            steps = [s * way for s in settings['speeds'] for way in (1.0, -1.0)]
            speed = np.array(steps)[np.minimum((t / DURATION * len(steps)).astype(int),
                                               len(steps) - 1)]
        elif family == 'slow_reversals':
            speed = settings['speed'] * np.where(t % settings['period'] < settings['period'] / 2,
                                                 1.0, -1.0)
        else:
            speed = settings['speed'] * np.where(t < DURATION / 2, 1.0, -1.0)
        columns['reference_velocity'] = speed
        columns['reference_position'] = np.cumsum(speed) * period
        if family == 'load_steps':
            torque = settings['torque'] * np.array((0.0, 0.5, 1.0, -0.5, -1.0))
            columns['external_torque'] = torque[(t * 2.0 % len(torque)).astype(int)]
    elif family == 'chirp':
        rate = (settings['to'] - settings['from']) / DURATION
        columns['voltage'] = settings['amplitude'] * np.sin(
            2.0 * np.pi * (settings['from'] + 0.5 * rate * t) * t)
    else:
        waves = settings.get('frequencies', [settings.get('frequency', 1.0)])
        columns['voltage'] = settings['amplitude'] / np.sqrt(len(waves)) * sum(
            np.sin(2.0 * np.pi * f * t + 1.7 * i * i) for i, f in enumerate(waves))
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


def _separation(recording, evidence, screening, one: Candidate, other: Candidate) -> float:
    """How large the effect of one cause stays when the other may imitate it, in noise units."""
    extended = evidence.stacks['screen'].extended
    seen = observe([recording], evidence.servo)[0]
    stack = Stack([Balance(extended.servo, seen, extended.given)], extended)
    if not len(stack.base):
        return 0.0
    _, nuisances, _, _ = stack.nuisances()
    explanation = evidence.best.explanation
    sizes = np.array([explanation.theta[extended.slot(p, e)] - extended.theta[extended.slot(p, e)]
                      for p, e in zip(one.paths, one.elements, strict=True)])
    sizes = np.where(np.abs(sizes) > 0.0, sizes, 1e-9)
    mine = stack.columns(one, sizes) @ sizes
    index = next(i for i, c in enumerate(screening.library.candidates) if c == other)
    theirs = stack.columns(other, screening.library.amplitudes[index])
    table = np.column_stack((nuisances, theirs))
    weight = np.sqrt((table**2).sum(axis=0)) + 1e-300
    fitted = np.linalg.lstsq(table / weight, mine, rcond=1e-9)[0]
    return float(np.sqrt(np.sum((mine - table / weight @ fitted)**2)))
