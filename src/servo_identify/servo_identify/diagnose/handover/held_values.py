"""Values that a simulation tells worse than the equations do: waves over an angle, and others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from servo_twin.physics.servo import Placed, Servo, Value

from ...fit.estimate import Estimate
from ...fit.free_values import SURE
from ..decisions import FORM
from .added import Added
from .gap import Gap
from .trial import Trial


def waves_held(one: Added, trial: Trial, starts: Sequence[Servo]) -> Added:
    """
    Return an effect with the waves held that a fit by simulation would make too small.

    The angle of a twin drifts from that of the rig. A wave over it comes too early or too late
    then, and the wave that is nearest to the rig's is smaller by

    .. math:: 1 - e^{-\\sigma^2 / 2}

    where sigma is the drift in phase, rad. More than the form of a law may be off is too much: the
    equations follow the angle of the rig and know better. ``starts`` are the files that a fit
    begins at.
    """
    waves = [placed for placed in one.placed if 'cosine' in placed.effect.parameters]
    if not waves or not one.stds:
        return one
    gaps = [gap for start in starts for gap in [trial.with_added(start, one)] if gap is not None]
    nearest = min(gaps, key=lambda gap: gap.total(), default=None)
    if nearest is None:
        return one
    ratio = starts[0].numbers['mechanism.ratio']
    drifts = {placed.name: _order(placed, one) * _drift(nearest, placed, ratio)
              for placed in waves}
    return replace(one, held=frozenset(
        f'effects.{name}.{row}' for name, drift in drifts.items()
        if 1.0 - np.exp(-0.5 * drift**2) > FORM for row in ('cosine', 'sine')))


def surer(one: Added, fit: Estimate) -> Added:
    """
    Return an effect with the values held that the equations know better than a fit.

    Where that is so of all that the equations have an amplitude of, what they searched beside it
    (a frequency, a damping) is held too. A shape goes with its amplitude: the travel of a loop is
    held where its level is. How sure an amplitude is by the equations holds for the shape that
    they searched: where the fit tells another, it knows both better.
    """
    sure = {name.partition('[')[0] for name in one.stds}
    if not all(_agrees(fit, path, one.values[path]) for path in one.fitted if path not in sure):
        return one
    held = set(one.held)
    for path in one.fitted:
        row = [name for name in one.stds if name.partition('[')[0] == path]
        given = np.atleast_1d(one.values[path])
        if row and all(fit.std_within.get(name, 0.0) > max(one.stds[name], abs(
                fit.values[name] - value) / SURE) for name, value in zip(row, given, strict=True)):
            held.add(path)
    if sure and sure <= held:
        held |= set(one.free)
    for placed in one.placed:
        own = f'effects.{placed.name}.'
        if {own + name for name in placed.effect.amplitudes()} <= held:
            held |= {path for path in one.free if path.startswith(own)}
    return replace(one, held=frozenset(held))


def _agrees(fit: Estimate, path: str, given: Value) -> bool:
    """Tell whether a fit leaves room for the value that the equations searched."""
    row = np.atleast_1d(given)
    names = [f'{path}[{k}]' for k in range(len(row))] if isinstance(given, tuple) else [path]
    return not any(abs(fit.values[name] - value) > SURE * fit.std_within.get(name, 0.0)
                   for name, value in zip(names, row, strict=True) if name in fit.values)


def _order(placed: Placed, one: Added) -> float:
    """Return the order of the largest wave of an effect, in its own angle."""
    cosine, sine = (np.atleast_1d(one.values[f'effects.{placed.name}.{name}'])
                    for name in ('cosine', 'sine'))
    base = float(np.max(np.atleast_1d(one.values.get(f'effects.{placed.name}.order', 1.0))))
    return base * (1 + int(np.argmax(np.hypot(cosine, sine))))


def _drift(gap: Gap, placed: Placed, ratio: float) -> float:
    """Return by how much the angle of an effect is off in a simulation, rad."""
    motor = 'motor' in placed.site
    for channel, factor in (('motor_position', 1.0 if motor else 1.0 / ratio),
                            ('load_position', ratio if motor else 1.0))[::1 if motor else -1]:
        if channel in gap.squares:
            return factor * gap.rms(channel)
    return 0.0
