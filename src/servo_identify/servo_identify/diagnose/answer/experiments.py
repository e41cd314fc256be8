"""The recording that would tell two explanations apart, as a command to copy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from servo_twin.physics.servo import Servo, ServoError
from servo_twin.physics.state import INPUTS
from servo_twin.recording.recording import Recording

from ...experiment.reach import CHANNELS, reach_of, reached
from ..decisions import PRACTICAL
from ..handover.added import added_of, servo_with
from ..handover.curves import curve_of, Part
from ..selection.confidence import Rival
from .candidate_runs import DURATION, mode_of, run, simulated
from .evidence import Evidence, Finding
from .shown_units import channel_unit

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
    differ most beyond what the given recordings show already, in units of noise and margin. Where
    none adds anything for any two, ``family`` is empty, and ``measure`` names a value that would
    tell the first two.
    """
    first: dict[str, Any] = {}
    for one in evidence.named:
        for rival in one.rivals:  # the likelier first; what no recording tells, the next may
            answer = _of_pair(evidence, one, rival, reach)
            if answer['family']:
                return answer
            first = first or answer
    return first


def _of_pair(evidence: Evidence, one: Finding, rival: Rival, reach: Mapping[str, float]
             ) -> dict[str, Any]:
    """Return what to record next to tell a finding from a rival."""
    two = one.part.mechanism, rival.mechanism
    same = two[0].name == two[1].name  # then it is the place that is not told
    pair = [mechanism.label if same else mechanism.name for mechanism in two]
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
    """
    Yield (new, family, settings, channel, sizes, unit) of each candidate.

    ``new`` is what it tells beyond the given recordings: squares of such ratios add up, so that
    one which is there already adds nothing.
    """
    recordings = [one.measured.recording for one in evidence.found.samples.errors]
    limits = reached(recordings) * BEYOND
    for k, name in enumerate(('travel', 'speed', 'torque')):
        limits[k] = max(limits[k], reach.get(name, 0.0))
    noise = evidence.found.samples.errors[0].measured.noise
    known = _known(recordings, twins, noise)
    for family, settings in _candidates(evidence, limits, reach):
        both = [y for y in (simulated(twin, family, settings, recordings[0].period)
                            for twin in twins) if y is not None]
        if len(both) < len(twins) or np.any(reach_of(both[0]) > 1.001 * limits + 1e-12):
            continue
        for channel in CHANNELS:
            if recordings[0].has(channel):
                ratio, sizes = _apart(channel, both, noise)
                new = float(np.sqrt(max(ratio**2 - known[mode_of(settings)]**2, 0.0)))
                unit = channel_unit(evidence.servo, channel)
                yield new, family, settings, channel, sizes, unit


def _apart(channel: str, both: Sequence[Mapping[str, Any]], noise: Mapping[str, float]
           ) -> tuple[float, list[float]]:
    """Return how far two twins are apart in a channel, over noise and margin; the rms of each."""
    first, second = (y[channel] for y in both)
    if channel.endswith('position'):
        first, second = first - first[0], second - second[0]
    sizes = [float(np.sqrt(np.mean(y**2))) for y in (first, second)]
    apart = float(np.sqrt(np.mean((first - second)**2)))
    floor = np.hypot(float(np.nan_to_num(noise.get(channel, 0.0))), MARGIN * sizes[0])
    return apart / max(floor, 1e-300), sizes


def _known(recordings: Sequence[Recording], twins: tuple[Servo, Servo],
           noise: Mapping[str, float]) -> dict[str, float]:
    """Return, by the way of running, how far the twins are apart in the given recordings."""
    known = {'measured_input': 0.0, 'closed_loop': 0.0}
    for one in recordings:
        led = one.has('reference_velocity') or one.has('reference_position')
        mode = 'closed_loop' if led and twins[0].controller.parameters else 'measured_input'
        count = min(int(DURATION / one.period), len(one))
        start = one['motor_position'][0], one['load_position'][0]
        runs = [run(twin, {name: one[name][:count] for name in INPUTS}, one.period, mode, start)
                for twin in twins]
        both = [y for y in runs if y is not None]
        if len(both) == len(runs):
            known[mode] = max(known[mode], *(_apart(channel, both, noise)[0]
                                             for channel in CHANNELS if one.has(channel)))
    return known


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
