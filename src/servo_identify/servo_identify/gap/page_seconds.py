"""Rig and twin beside each other: the seconds that show it best, and the gap after each step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from servo_twin.balances.goodness_of_fit import shown_unit, speed_of

from .balance import Balance
from .explanation import as_given
from .resimulation import _starts, Gap, HORIZON, resimulate, Run

WINDOW = 3.0  # s of a recording that are shown


@dataclass(frozen=True)
class Seconds:
    """
    The seconds of a report recording that show best what the causes change.

    ``curves`` are rig, twin and augmented twin in ``unit`` (of a position, its speed), ``errors``
    rig less twin in ``error_unit``; shape (samples,) each, NaN where a run starts anew.
    """

    recording: str
    family: str
    channel: str
    time: np.ndarray
    curves: dict[str, np.ndarray]
    unit: str
    errors: dict[str, np.ndarray]
    error_unit: str
    noise: float


def telling_seconds(evidence) -> Seconds | None:
    """Return the seconds, channel and recording where the causes change most; None of nothing."""
    gap: Gap = evidence.reported['given']
    ways = [as_given(evidence.stacks['report']), evidence.base.explanation,
            evidence.best.explanation]
    best = None
    for one in evidence.stacks['report'].balances:
        given, bounded, augmented = (resimulate(one, way.theta, way.on) for way in ways)
        size = min(len(one.seen.recording), max(2, int(WINDOW / one.seen.period)))
        for channel in given.errors:
            before = _over(bounded.errors[channel], size)
            worth = before / gap.signal[channel]**2
            if evidence.choices:  # what the causes take, not what the tolerances allow
                taken = 1.0 - _over(augmented.errors[channel], size) / np.maximum(before, 1e-300)
                worth = worth * np.maximum(taken, 0.0)**3
            first = int(np.argmax(worth))
            if best is None or worth[first] > best[0]:
                runs = {'twin': given, 'augmented': augmented}
                best = (worth[first], one, channel, slice(first, first + size), runs)
    if best is None:
        return None
    _, one, channel, part, runs = best
    return _shown(one, channel, part, runs, gap.floor[channel], evidence.servo.linear)


def _shown(one: Balance, channel: str, part: slice, runs: dict[str, Run], noise: float,
           linear: bool) -> Seconds:
    recording, period = one.seen.recording, one.seen.period
    starts = _starts(one, max(4, int(round(HORIZON / period))))
    errors = {name: run.errors[channel] for name, run in runs.items()}
    if channel == 'wind_up':
        ratio = one.servo.values['mechanism.ratio']
        rig = recording['motor_position'] / ratio - recording['load_position']
        rig = rig - np.nanmedian(rig)
    else:
        rig = recording['voltage' if channel == 'command' else channel]
    curves = {'rig': rig, **{name: rig - error for name, error in errors.items()}}
    unit = error_unit = {'torque': 'N m', 'current': 'A', 'command': 'V'}.get(channel, 'rad')
    blurred = starts
    if channel.endswith('position'):
        curves = {name: speed_of(curve, period) for name, curve in curves.items()}
        unit = 'rad/s'
        half = int(np.count_nonzero(np.isnan(curves['rig'][:len(rig) // 2])))
        blurred = np.clip(starts[:, None] + np.arange(-half, half + 1), 0, len(rig) - 1)
    for name in runs:
        curves[name] = _cut(curves[name], np.unique(blurred))
        errors[name] = _cut(errors[name], starts)
    return Seconds(
        recording.name, recording.family, channel, recording.time[part],
        {n: c[part] for n, c in curves.items()}, shown_unit(unit, linear),
        {n: e[part] for n, e in errors.items()}, shown_unit(error_unit, linear), noise)


def _over(error: np.ndarray, size: int) -> np.ndarray:
    """Mean square of an error over the `size` samples that follow each one."""
    sums = np.concatenate(([0.0], np.cumsum(np.nan_to_num(error)**2)))
    return (sums[size:] - sums[:-size]) / size


def _cut(curve: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Leave out where a run starts anew, so that no line joins one run to the next."""
    curve = curve.copy()
    curve[at] = np.nan
    return curve


def steps(evidence, waterfall: list[dict]) -> list[dict]:
    """Return the bars of a waterfall, each gap with its 90 % interval by drawing blocks anew."""
    reported = evidence.reported
    base: Gap = reported['base']
    gaps = [reported['given'], base, *(s['report']['upto'] for s in reported['steps'])]
    size = min((len(part) for part in base.squares.values()), default=0)
    if not size:
        return [{**bar, 'interval': (bar['gap'], bar['gap'])} for bar in waterfall]
    draws = np.random.default_rng(0).integers(0, size, (200, size))
    shown = []
    for bar, gap in zip(waterfall, gaps, strict=True):
        values = [gap.total(base, blocks, excess=False) for blocks in draws]
        shown.append({**bar, 'interval': tuple(np.percentile(values, (5, 95)))})
    return shown
