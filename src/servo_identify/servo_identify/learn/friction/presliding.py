"""
The part of friction that bends before it slips, found from open-loop runs.

Steady turns say nothing of presliding: what slips resists as Coulomb friction does. What tells it
is when a shaft leaves its dead zone. So a share of the level that the networks learned is handed
to presliding friction (LuGre without a static excess). How much, and over what angle, is what
makes the free runs over the recordings fit best (paper 000 eq. 13).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed, Provenance, Servo
from servo_twin.recording.recording import Recording

from ...fit.estimate import bag_name
from ..free_run import free_runs

NAME = 'bristles'
LAG = 1e-4  # s, damping of the bristles over their stiffness: below what a millisecond tells
SHARES, TRAVELS = (0.3, 0.6), (5e-5, 2e-4, 1e-3)  # of the networks' least level; rad
SHORTEST, LONGEST = 1e-6, 1e-2  # rad
EVALUATIONS = 40


@dataclass(frozen=True)
class Presliding:
    """``level`` N m that presliding carries, ``breakaway`` rad; mean R before and after."""

    level: float
    breakaway: float
    before: float
    after: float
    bags: tuple[str, ...]


def learned_presliding(servo: Servo, recordings: Sequence[Recording], friction: str = 'friction',
                       told: Callable[[float], None] | None = None) -> Presliding:
    """
    Find the presliding friction at the shaft of the friction networks named ``friction``.

    ``told`` is given the mean R of each trial. Raises ValueError where the servo has no such
    networks, and where no recording has a command.
    """
    placed = next((p for p in servo.effects if p.name == friction
                   and p.effect.name == 'network_friction'), None)
    if placed is None:
        raise ValueError(f'{servo.name}: presliding takes its level from learned friction; there '
                         f'is no network_friction named {friction!r}')
    recordings = [r for r in recordings if r.has('voltage')]
    if not recordings:
        raise ValueError('presliding is learned from runs whose voltage was recorded')
    servo = without_presliding(servo, friction)
    most = least_level(servo, friction)

    def fit_of(level: float, breakaway: float) -> float:
        trial = with_presliding(servo, Presliding(level, breakaway, 0.0, 0.0, ()), friction)
        fits = [run.speed_fit for run in free_runs(trial, recordings)]
        mean = float(np.mean(np.where(np.isfinite(fits), fits, -1.0)))
        if told:
            told(mean)
        return mean

    def within(x: np.ndarray) -> tuple[float, float]:
        return (float(np.clip(np.exp(x[0]), 0.0, 1.0)) * most,
                float(np.clip(np.exp(x[1]), SHORTEST, LONGEST)))

    def loss(x: np.ndarray) -> float:
        outside = max(0.0, x[0]) + max(0.0, np.log(SHORTEST) - x[1], x[1] - np.log(LONGEST))
        return 1.0 - fit_of(*within(x)) + 0.1 * outside

    grid = [np.log([share, travel]) for share in SHARES for travel in TRAVELS]
    first = min(grid, key=loss)
    simplex = first + np.array([[0.0, 0.0], [0.4, 0.0], [0.0, -0.5]])
    found = minimize(loss, first, method='Nelder-Mead', options={
        'maxfev': EVALUATIONS, 'initial_simplex': simplex, 'fatol': 1e-5, 'xatol': 0.01})
    before = float(np.mean([run.speed_fit for run in free_runs(servo, recordings)]))
    return Presliding(*within(found.x), before, float(1.0 - found.fun),
                      tuple(bag_name(r) for r in recordings))


def least_level(servo: Servo, friction: str) -> float:
    """Return the least friction, N m, that the networks give at standstill over the turn."""
    values = {k.rpartition('.')[2]: v for k, v in servo.values.items()
              if k.startswith(f'effects.{friction}.')}
    angle = np.linspace(0.0, values['turn'], 200, endpoint=False)
    x1 = (angle - values['angle_centre']) / values['angle_span']
    x2 = -values['speed_centre'] / values['speed_span']
    levels = []
    for way in ('forward', 'reverse'):
        w1, w2, threshold, weight = (np.array(values[f'{way}_{name}']) for name in (
            'angle', 'speed', 'threshold', 'weight'))
        levels.append(np.tanh(np.outer(x1, w1) + w2 * x2 - threshold) @ weight
                      - values[f'{way}_level'])
    return max(0.0, float(np.min(levels)))


def without_presliding(servo: Servo, friction: str = 'friction') -> Servo:
    """Return the servo whose friction networks have the level of any presliding friction back."""
    if NAME not in {p.name for p in servo.effects}:
        return servo
    level = servo.values[f'effects.{NAME}.level']
    thresholds = {f'effects.{friction}.{way}_level':
                  servo.values[f'effects.{friction}.{way}_level'] - level
                  for way in ('forward', 'reverse')}
    return servo.without_effects(lambda placed: placed.name == NAME).with_values(thresholds)


def with_presliding(servo: Servo, found: Presliding, friction: str = 'friction') -> Servo:
    """Return the servo whose friction networks hand their level over to presliding friction."""
    servo = without_presliding(servo, friction)
    site = next(p.site for p in servo.effects if p.name == friction)
    thresholds = {f'effects.{friction}.{way}_level':
                  servo.values[f'effects.{friction}.{way}_level'] + found.level
                  for way in ('forward', 'reverse')}
    bristles = {f'effects.{NAME}.level': found.level, f'effects.{NAME}.excess': 0.0,
                f'effects.{NAME}.breakaway': found.breakaway, f'effects.{NAME}.lag': LAG}
    said = {path: Provenance('free runs, paper 000 eq. 13', None, found.bags)
            for path in (f'effects.{NAME}.level', f'effects.{NAME}.breakaway')}
    placed = Placed(NAME, find('presliding_friction'), site)
    return servo.with_effects(placed, values={**thresholds, **bristles}, provenance=said)
