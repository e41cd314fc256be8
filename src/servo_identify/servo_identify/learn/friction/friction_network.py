"""
The network of paper 000: two inputs, one hidden layer of tansig, one output of purelin.

.. math:: \\hat y = \\sum_{j=1}^m v_j \\tanh(w_{1j} x_1 + w_{2j} x_2 - \\alpha_j) - \\beta

(eq. 5 and 6). The paper descends the gradient (eq. 7 to 9); Levenberg-Marquardt finds the same
minimum of the same loss in a second.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from servo_twin.physics.servo import Value

HIDDEN = 30  # nodes, paper 000 section 3.1
ITERATIONS = 1000
TARGET = 1e-12  # of the mean square error, in units of the target's variance


@dataclass(frozen=True)
class Network:
    """
    Trained weights with the scaling of their inputs.

    ``angle``, ``speed``, ``threshold``, ``weight`` of shape (nodes,): w1, w2, alpha, v of the
    paper; ``level`` its beta; ``centre`` and ``span`` (2,) make x of the inputs. ``losses`` are
    the mean square errors on training and validation rows, one pair an iteration.
    """

    angle: np.ndarray
    speed: np.ndarray
    threshold: np.ndarray
    weight: np.ndarray
    level: float
    centre: np.ndarray
    span: np.ndarray
    losses: tuple[tuple[float, float], ...] = ()

    def __call__(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return the output for inputs of shape (rows,)."""
        x1 = (np.asarray(first) - self.centre[0]) / self.span[0]
        x2 = (np.asarray(second) - self.centre[1]) / self.span[1]
        inside = np.outer(x1, self.angle) + np.outer(x2, self.speed) - self.threshold
        return np.tanh(inside) @ self.weight - self.level

    def values(self, first: str, second: str) -> dict[str, Value]:
        """Return the values of an effect that is this network, by the names of its inputs."""
        return {f'{first}_centre': float(self.centre[0]), f'{first}_span': float(self.span[0]),
                f'{second}_centre': float(self.centre[1]), f'{second}_span': float(self.span[1]),
                first: tuple(self.angle.tolist()), second: tuple(self.speed.tolist()),
                'threshold': tuple(self.threshold.tolist()),
                'weight': tuple(self.weight.tolist()), 'level': float(self.level)}

    def sigmoid_values(self, first: str, second: str) -> dict[str, Value]:
        """Return those of an effect of sigmoids s: tanh(z) = 2 s(2 z) - 1."""
        doubled = replace(self, angle=2.0 * self.angle, speed=2.0 * self.speed,
                          threshold=2.0 * self.threshold, weight=2.0 * self.weight,
                          level=self.level + self.weight.sum())
        return doubled.values(first, second)

    @property
    def size(self) -> int:
        """How many numbers were trained."""
        return 4 * len(self.angle) + 1


@threadpool_limits.wrap(limits=1)  # waiting for each other, two threads on busy cores crawl
def trained(first: np.ndarray, second: np.ndarray, target: np.ndarray, *, hidden: int = HIDDEN,
            seed: int = 0, iterations: int = ITERATIONS, held: np.ndarray | None = None,
            patience: int = 15, decay: float = 1e-7,
            told: Callable[[int, float, float], None] | None = None) -> Network:
    """
    Train by Levenberg-Marquardt from Nguyen-Widrow weights.

    ``held`` (rows,) marks rows kept for validation: training stops when they have not improved for
    ``patience`` iterations and returns the best. ``decay`` keeps weights from running away, in
    units of the scaled target. ``told(iteration, loss, held loss)`` after each.
    Raises ValueError for fewer rows than weights.
    """
    rows = len(target)
    held = np.zeros(rows, dtype=bool) if held is None else np.asarray(held)
    if (~held).sum() < 4 * hidden + 1:
        raise ValueError(f'{(~held).sum()} rows are too few for the {4 * hidden + 1} weights of '
                         f'{hidden} nodes')
    inputs = np.column_stack([first, second]).astype(float)
    low, high = inputs.min(axis=0), inputs.max(axis=0)
    centre, span = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1e-9)
    x = (inputs - centre) / span
    middle, size = target.mean(), max(float(target.std()), 1e-12)
    y = (target - middle) / size

    weights = _start(hidden, np.random.default_rng(seed))
    losses, best, best_loss, since, damping = [], weights, np.inf, 0, 1e-2
    at, jacobian = _residual(weights, x[~held], y[~held], True)
    for iteration in range(iterations):
        hessian = jacobian.T @ jacobian / len(at) + decay * np.eye(len(weights))
        gradient = jacobian.T @ at / len(at) + decay * weights
        loss = at @ at / len(at) + decay * weights @ weights
        while damping < 1e12:
            step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), gradient)
            trial = weights - step
            new, _ = _residual(trial, x[~held], y[~held], False)
            if new @ new / len(new) + decay * trial @ trial < loss:
                break
            damping *= 4.0
        else:
            break
        damping = max(damping / 5.0, 1e-12)
        weights = trial
        at, jacobian = _residual(weights, x[~held], y[~held], True)
        now = float(at @ at / len(at))
        kept = float(np.mean(_residual(weights, x[held], y[held], False)[0] ** 2)
                     ) if held.any() else now
        losses.append((now * size**2, kept * size**2))
        if told:
            told(iteration, *losses[-1])
        if kept < best_loss * (1.0 - 1e-3):
            best, best_loss, since = weights, kept, 0
        else:
            since += 1
        if since >= patience or now < TARGET:
            break
    w1, w2, alpha, v, beta = _split(best)
    return Network(w1, w2, alpha, v * size, float(beta * size - middle), centre, span,
                   tuple(losses))


def _start(hidden: int, rng: np.random.Generator) -> np.ndarray:
    """Nguyen and Widrow 1990: nodes that share the input square among them."""
    directions = rng.normal(size=(hidden, 2))
    directions *= 0.7 * hidden**0.5 / np.linalg.norm(directions, axis=1, keepdims=True)
    threshold = 0.7 * hidden**0.5 * np.linspace(-1.0, 1.0, hidden) * np.sign(rng.normal(
        size=hidden))
    return np.concatenate([directions[:, 0], directions[:, 1], threshold,
                           rng.normal(scale=0.1, size=hidden), [0.0]])


def _split(weights: np.ndarray) -> tuple[np.ndarray, ...]:
    m = (len(weights) - 1) // 4
    return weights[:m], weights[m:2 * m], weights[2 * m:3 * m], weights[3 * m:4 * m], weights[-1]


def _residual(weights: np.ndarray, x: np.ndarray, y: np.ndarray,
              slopes: bool) -> tuple[np.ndarray, np.ndarray | None]:
    w1, w2, alpha, v, beta = _split(weights)
    node = np.tanh(np.outer(x[:, 0], w1) + np.outer(x[:, 1], w2) - alpha)
    error = node @ v - beta - y
    if not slopes:
        return error, None
    inner = (1.0 - node**2) * v
    return error, np.hstack([inner * x[:, :1], inner * x[:, 1:], -inner, node,
                             np.full((len(x), 1), -1.0)])
