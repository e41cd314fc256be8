"""The recording that would tell two explanations apart, as a command to copy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from servo_twin.physics.servo import Servo, ServoError
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS, OUTPUTS

from ...experiment.reach import CHANNELS, reach_of, reached
from ..decisions import PRACTICAL
from ..handover.added import added_of, servo_with
from ..handover.curves import curve_of, Part
from ..selection.confidence import Rival
from .evidence import Evidence, Finding
from .shown_units import channel_unit

DURATION = 10.0  # s of each candidate
BEYOND = 1.2  # times the largest travel, speed and torque seen that a recording may reach
MARGIN = 10.0 * PRACTICAL  # share of a signal within which two twins look alike to a person
READABLE = ('drive.', 'mechanism.')  # values that an instrument can read by themselves

PROCEDURES = {'speed_ladder': 'speed_ladder', 'slow_reversals': 'slow_reversals',
              'load_steps': 'load_steps', 'chirp': 'chirp', 'multisine': 'multisine',
              'sine': 'open_loop_sine'}
"""The procedure of `servo-identify experiment` that records a family."""


def next_experiment(evidence: Evidence, reach: Mapping[str, float]) -> dict[str, Any]:
    """
    Return what to record next, empty where nothing is left to tell apart.

    ``{separates, family, settings, command, expected, expected_ratio}``: of the candidates within
    what the rig was seen to do (or ``reach``), the one in which the twins of two explanations
    differ most, in units of noise and margin. Where none differs, ``family`` is empty, and
    ``measure`` names a value that would tell.
    """
    open_pairs = [(one, one.rivals[0]) for one in evidence.named if one.rivals]
    if not open_pairs:
        return {}
    one, rival = open_pairs[0]
    pair = [one.part.mechanism.name, rival.mechanism.name]
    other = _other(evidence, one, rival)
    if other is None:
        return {'separates': pair, 'family': '', 'settings': {}}
    twins = evidence.handover.patch, other
    best = max(_told(evidence, twins, reach), key=lambda found: found[0], default=None)
    if best is None or best[0] <= 1.0:
        return {'separates': pair, 'family': '', 'settings': {}} | _measure(pair, twins)
    ratio, family, settings, channel, sizes, unit = best
    expected = {name: f'{channel.replace("_", " ")} of {size:.3g} {unit} (root mean square)'
                for name, size in zip(pair, sizes, strict=True)}
    return {'separates': pair, 'family': family, 'settings': {**settings, 'duration': DURATION},
            'command': _command(family, settings), 'expected': expected,
            'expected_ratio': float(ratio)}


def _other(evidence: Evidence, one: Finding, rival: Rival) -> Servo | None:
    """Return the servo with a rival in the place of a finding."""
    found = evidence.found
    choice = found.explanation.smallest.choice.minus(one.part.number)
    fit = found.search.fitted(choice.plus(rival.number, rival.side))
    part = Part(rival.number, rival.mechanism, None, found.amplitudes(rival.number, fit))
    form = found.hypotheses[rival.number].form
    if form is not None:
        part = replace(part, curve=curve_of(found, rival.number, part.amplitudes[None, :],
                                            part.amplitudes))
    added = [a for a in added_of(found, [part]) if a.acts]
    rest = [a for a in evidence.handover.added if a.part.number != one.part.number]
    try:
        return servo_with(evidence.servo, [*rest, *added]) if added else None
    except ServoError:
        return None


def _told(evidence: Evidence, twins: tuple[Servo, Servo], reach: Mapping[str, float]
          ) -> Iterator[tuple[float, str, dict[str, Any], str, list[float], str]]:
    """Yield (ratio, family, settings, channel, sizes, unit) of each candidate."""
    recordings = [one.measured.recording for one in evidence.found.samples.errors]
    limits = reached(recordings) * BEYOND
    for k, name in enumerate(('travel', 'speed', 'torque')):
        limits[k] = max(limits[k], reach.get(name, 0.0))
    noise = evidence.found.samples.errors[0].measured.noise
    for family, settings in _candidates(evidence, limits, reach):
        both = [y for y in (_simulated(twin, family, settings, recordings[0].period)
                            for twin in twins) if y is not None]
        if len(both) < len(twins) or np.any(reach_of(both[0]) > 1.001 * limits + 1e-12):
            continue
        for channel in CHANNELS:
            if not recordings[0].has(channel):
                continue
            first, second = (y[channel] for y in both)
            if channel.endswith('position'):
                first, second = first - first[0], second - second[0]
            size = float(np.sqrt(np.mean(first**2)))
            apart = float(np.sqrt(np.mean((first - second)**2)))
            floor = np.hypot(float(np.nan_to_num(noise.get(channel, 0.0))), MARGIN * size)
            unit = channel_unit(evidence.servo, channel)
            yield (apart / max(floor, 1e-300), family, settings, channel,
                   [size, float(np.sqrt(np.mean(second**2)))], unit)


def _candidates(evidence: Evidence, limits: np.ndarray,
                reach: Mapping[str, float]) -> list[tuple[str, dict[str, Any]]]:
    """Return (family, settings) of recordings within limits, those of the rig so far."""
    errors = evidence.found.samples.errors
    travel, speed, _ = limits / BEYOND
    volts = max(float(np.nanpercentile(np.abs(e.measured.column('voltage', 0.0)), 99))
                for e in errors)
    volts = max(volts, reach.get('amplitude', 0.0))
    load = max(float(np.max(np.abs(e.measured.column('external_torque', 0.0)))) for e in errors)
    load = max(load, reach.get('torque', 0.0))
    found: list[tuple[str, dict[str, Any]]] = []
    if evidence.servo.controller.parameters and speed > 0.0:
        rise = {'acceleration': 10.0 * speed}
        top = min(speed, 8.0 * travel / DURATION)
        found += [('speed_ladder', {'speeds': np.geomspace(0.05 * top, top, 4).tolist(), **rise})]
        found += [('slow_reversals', {'speed': share * speed, 'period': 2.5})
                  for share in (0.02, 0.1, 0.5)]
        if load > 0.0:
            found += [('load_steps', {'speed': min(share * speed, travel / 4.0),
                                      'torque': part * load, **rise})
                      for share, part in ((0.3, 1.0), (0.03, 1.0), (0.03, 0.3))]
    if volts > 0.0:
        found += [('chirp', {'amplitude': share * volts, 'from': 0.5, 'to': 15.0})
                  for share in (0.7, 0.25)]
        found += [('multisine', {'amplitude': share * volts, 'from': 0.5, 'to': 10.0, 'lines': 8})
                  for share in (0.9, 0.3)]
        found += [('sine', {'amplitude': 0.8 * volts, 'frequency': 0.5}),
                  ('sine', {'amplitude': 0.4 * volts, 'frequency': 2.0})]
    return found


def _simulated(servo: Servo, family: str, settings: dict[str, Any],
               period: float) -> dict[str, Any] | None:
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
    try:
        y = simulate(servo, inputs_of(columns), period, initial_state(servo), mode)
    except ServoError:
        return None
    if not np.isfinite(y[:, :4]).all():
        return None
    return dict(zip(OUTPUTS, y.T, strict=True)) | {'period': period}


def _waves(family: str, settings: dict[str, Any], t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
    if family == 'speed_ladder':
        levels = np.repeat(settings['speeds'], 2)
        place = np.minimum((t / DURATION * len(levels)).astype(int), len(levels) - 1)
        speed, torque = levels[place] * np.where(place % 2, -1.0, 1.0), still
    else:  # load_steps
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


def _command(family: str, settings: dict[str, Any]) -> str:
    """Return the command line that records a family on the rig."""
    words = ['servo-identify', 'experiment', PROCEDURES[family], '-o', 'next', '--servo',
             'SERVO.yaml', '--duration', f'{DURATION:g}']
    for key, option in (('speeds', '--speeds'), ('speed', '--speeds'), ('torque', '--torques'),
                        ('amplitude', '--amplitudes'), ('frequency', '--frequencies')):
        if key in settings:
            several = settings[key] if isinstance(settings[key], list) else [settings[key]]
            words += [option, *(f'{v:.4g}' for v in several)]
    return ' '.join(words)


def _measure(pair: list[str], twins: tuple[Servo, Servo]) -> dict[str, Any]:
    """Return ``{measure: {parameter, unit, values}}`` of a value that the two disagree about."""
    for path in twins[0].values:
        if not path.startswith(READABLE) or path not in twins[1].values:
            continue
        values = [twin.numbers[path] for twin in twins if path in twin.numbers]
        if len(values) == 2 and abs(values[0] - values[1]) > MARGIN * max(map(abs, values)):
            return {'measure': {'parameter': path, 'unit': twins[0].unit(path),
                                'values': dict(zip(pair, values, strict=True))}}
    return {}
