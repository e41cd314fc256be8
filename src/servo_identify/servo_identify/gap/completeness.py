"""
Whether anything predictable is left, and what it looks like.

A flexible regressor with blocked cross-validation is the ceiling of what any law of the same
variables could explain; what it finds in the residual is described for whoever writes the law.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from servo_twin.physics.following import MOTION

from .balance import BALANCES
from .scales import orders
from .screening import FOLDS
from .stack import Stack

ANGLE_OF = {'motor': 'motor_angle', 'drive': 'motor_angle', 'load': 'load_angle',
            'torque': 'load_angle', 'transmission': 'load_angle', 'controller': 'load_angle'}
ANGLES = {'motor_angle': 'angle of the motor', 'load_angle': 'angle of the load'}
VARIABLES = ('angle of the load', 'angle of the motor', 'speed', 'torque', 'current', 'wind-up',
             'acceleration', 'direction', 'travel since reversal', 'time', 'temperature')


@dataclass(frozen=True)
class Remainder:
    """
    What is left in one balance.

    ``predictable`` is the mean square that a flexible law could still take away, in units of the
    scale; ``depends_on`` names its variables, strongest first; ``parity`` is odd when it flips
    with the direction of motion; ``orders`` are those of a shaft turn.
    """

    balance: str
    square: float
    predictable: float
    depends_on: tuple[str, ...]
    parity: str
    orders: tuple[float, ...]
    memory: bool
    drift: bool
    curve: tuple[np.ndarray, np.ndarray] | None


def features(stack: Stack, balance: str) -> np.ndarray:
    """Return the variables of :data:`VARIABLES` at the rows of a balance, (rows, variables)."""
    def of(one):
        bump, reach = one.bump_of(balance), one.seen.bump.reach
        centres = bump.centres(len(one.seen.recording))
        at = np.clip(centres - reach, 0, len(one.motion('load_angle')) - 1)
        motion = {n: one.motion(n)[at] for n in MOTION}
        speed = motion['load_speed']
        turned = since_reversal(one.motion('load_angle'), one.motion('load_speed'))
        return np.column_stack((
            np.mod(motion['load_angle'], 2.0 * np.pi), np.mod(motion['motor_angle'], 2.0 * np.pi),
            speed, motion['torque'], motion['current'], motion['wind_up'],
            motion['load_acceleration'], np.sign(speed), turned[at],
            centres * one.seen.period, motion['temperature']))

    return stack.at_rows(balance, of)


def since_reversal(angle: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Return the travel since the last reversal, rad, shape of ``angle``; rest is none."""
    samples = np.arange(len(speed))
    moved = np.maximum.accumulate(np.where(speed != 0.0, samples, -1))  # when it last did
    way = np.sign(speed[moved])
    turns = (moved[1:] > 0) & (moved[:-1] >= 0) & (way[1:] != way[:-1])
    anchor = np.maximum.accumulate(np.where(np.concatenate(([False], turns)), samples, 0))
    return np.abs(angle - angle[anchor])


def remainder(stack: Stack, residual: np.ndarray, balance: str,
              known: tuple[str, ...] = ()) -> Remainder:
    """
    Describe what a residual (in units of the scale) leaves in a balance.

    ``known`` are variables that it is known to depend on; they come first.
    """
    from sklearn.ensemble import HistGradientBoostingRegressor
    from threadpoolctl import threadpool_limits

    rows = stack.balance == BALANCES.index(balance)
    target, table, block = residual[rows], features(stack, balance), stack.block[rows]
    thin = max(1, len(target) // 8000)
    target, table, block = target[::thin], table[::thin], block[::thin]
    square = float(np.mean(target**2))
    clipped = np.clip(target, *np.percentile(target, (0.5, 99.5)))
    predicted = np.zeros(len(target))
    importance = np.zeros(table.shape[1])
    chance = np.random.default_rng(0)
    folds = block % FOLDS
    for k in range(0, FOLDS, 2):
        test = (folds == k) | (folds == k + 1)
        if not test.any() or test.all():
            continue
        model = HistGradientBoostingRegressor(max_iter=60, max_leaf_nodes=12, min_samples_leaf=40,
                                              learning_rate=0.15, random_state=0)
        with threadpool_limits(1):  # its threads wait for each other on a busy machine
            model.fit(table[~test], clipped[~test])
            predicted[test] = model.predict(table[test])
            error = np.mean((clipped[test] - predicted[test])**2)
            for i in range(table.shape[1]):
                mixed = table[test].copy()
                mixed[:, i] = chance.permutation(mixed[:, i])
                importance[i] += np.mean((clipped[test] - model.predict(mixed))**2) - error
    taken = np.mean(clipped**2) - np.mean((clipped - predicted)**2)
    predictable = float(max(0.0, taken))
    strongest = np.argsort(importance)[::-1]
    found = (VARIABLES[i] for i in strongest[:3]
             if importance[i] > 0.15 * max(importance.max(), 1e-12))
    depends = tuple(dict.fromkeys((*known, *found)))
    name = ANGLES[ANGLE_OF[balance]]
    direction = np.sign(table[:, VARIABLES.index('speed')])
    flipped = target * direction
    odd = np.mean(flipped)**2 + _explained(table[:, 2], flipped)
    even = np.mean(target)**2 + _explained(table[:, 2], target)
    angle = table[:, VARIABLES.index(name)]
    # what the orders are multiplied by flips them, as the current does a ripple of the torque
    times = np.prod([np.sign(table[:, VARIABLES.index(v)]) for v in known if v != name], axis=0)
    leading = VARIABLES.index(depends[0]) if depends else VARIABLES.index('speed')
    return Remainder(
        balance, square, predictable, depends, 'odd' if odd > even else 'even',
        orders(angle, target * times) if name in depends else (),
        'travel since reversal' in depends, 'time' in depends or 'temperature' in depends,
        _curve(table[:, leading], predicted))


def repeatable(one: Stack, residual: np.ndarray, other: Stack,
               residual_there: np.ndarray) -> dict[str, float]:
    """
    Return by balance the mean square of the residual that replicates have in common.

    Recordings of the same family are compared instant by instant: noise does not repeat itself,
    whatever its colour; a missing law does, known or not. Every instant counts alike, as in the
    mean squares that this is held against. Empty without replicates.
    """
    common: dict[str, list[np.ndarray]] = {}
    for first, a in enumerate(one.balances):
        for second, b in enumerate(other.balances):
            same = a.seen.recording.family and (
                a.seen.recording.family == b.seen.recording.family)
            if not same or not _alike(a.seen, b.seen):
                continue
            for name in set(a.names) & set(b.names):
                x, y = one.series(first, name, residual), other.series(second, name,
                                                                       residual_there)
                size = min(len(x), len(y))
                product = x[:size] * y[:size]
                common.setdefault(name, []).append(product[np.isfinite(product)])
    together = {name: np.concatenate(products) for name, products in common.items()}
    return {name: max(0.0, float(np.mean(one))) for name, one in together.items() if one.size}


def _alike(one, other) -> bool:
    """Tell whether two recordings were driven alike."""
    size = min(len(one.recording), len(other.recording))
    for name in ('reference_velocity', 'reference_position', 'voltage'):
        if one.recording.has(name) and other.recording.has(name):
            x, y = one.column(name, 0.0)[:size], other.column(name, 0.0)[:size]
            spread = float(np.std(x) * np.std(y))
            return spread > 0.0 and float(np.mean((x - x.mean()) * (y - y.mean()))) > 0.98 * spread
    return False


def _explained(x: np.ndarray, y: np.ndarray) -> float:
    """Mean square of the means of y over bins of the size of x."""
    edges = np.quantile(np.abs(x), np.linspace(0, 1, 9)[1:-1])
    bins = np.digitize(np.abs(x), edges)
    means = np.array([y[bins == b].mean() if (bins == b).any() else 0.0 for b in range(8)])
    return float(np.mean((means - y.mean())**2))


def _curve(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    edges = np.unique(np.quantile(x, np.linspace(0, 1, 41)))
    bins = np.clip(np.digitize(x, edges) - 1, 0, max(len(edges) - 2, 0))
    middle = np.array([x[bins == b].mean() for b in range(len(edges) - 1) if (bins == b).any()])
    mean = np.array([y[bins == b].mean() for b in range(len(edges) - 1) if (bins == b).any()])
    return middle, mean
