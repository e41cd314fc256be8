r"""
How well an equation closes with factors that the servo file allows.

.. math:: \min_x \; \frac{n}{2} \ln(e(x) + e_0) + \sum_k \frac{(x_k - m_k)^2}{2 s_k^2}, \quad
          e = \frac{|y - F f - \sum_k e^{x_k} a_k|^2}{|y - \bar y|^2}

The factors are e^x, so that none changes its sign, and f is free. The error e is a share of what
is seen, so that units do not matter. The number n of samples is small, because neighbouring
samples and recordings are alike. The error e_0 is what a missing effect may leave without any
mistake in the units; it is that of the equation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .rough_balances import RoughBalance

SAMPLES = 30  # n: independent samples that a recording counts for at most
SPRING = 2.0  # nats that a spring costs which the servo file does not have
STEPS, ENOUGH = 30, 0.02  # of the descent; nats
APART, ASTRAY = 2.0, 0.3  # nats that a loop costs which does not follow; what it leaves open
WEAK = 0.55  # of the logarithm of how far such a loop goes of its reference


@dataclass(frozen=True)
class Closed:
    """
    An equation at its best: ``nats`` (the smaller the better), ``left`` of it, the factors.

    ``least`` are the nats of one that closes wholly, with the factors of the servo file.
    """

    nats: float
    left: float
    factors: dict[str, float]
    least: float = 0.0


def closed(balance: RoughBalance) -> Closed:
    """Return the balance at the best factors; where nothing is seen it says nothing."""
    best = _closed(balance, balance.free)
    if balance.spring is not None:
        sprung = _closed(balance, np.column_stack([balance.free, balance.spring]))
        if sprung.nats + SPRING < best.nats:
            best = replace(sprung, nats=sprung.nats + SPRING)
    return _of_loop(balance, best) if balance.loop else best


def _of_loop(balance: RoughBalance, best: Closed) -> Closed:
    """Return how a loop closes which may not follow, or only part of the way."""
    terms = {name: replace(term, spread=WEAK) for name, term in balance.terms.items()}
    weak = _closed(replace(balance, terms=terms), balance.free)
    apart = 0.5 * SAMPLES * np.log(ASTRAY + balance.open)
    nats = min(best.nats, float(apart) + APART, weak.nats + APART)
    return replace(best, nats=nats)


def _closed(balance: RoughBalance, free: np.ndarray) -> Closed:
    seen = balance.seen
    spread = seen - seen.mean() if free.shape[1] else seen
    size = float(np.linalg.norm(spread))
    names = [name for name, term in balance.terms.items() if np.any(term.column)]
    if not size > 1e-12 * (float(np.linalg.norm(seen)) + 1e-300) or not names:
        return Closed(0.0, 1.0, {})
    columns = np.stack([seen, *(balance.terms[name].column for name in names)], 1)
    columns = columns / size
    if free.shape[1]:
        base = np.linalg.qr(free / np.maximum(np.linalg.norm(free, axis=0), 1e-300))[0]
        columns = columns - base @ (base.T @ columns)
    gram = columns.T @ columns
    reach = np.sqrt(np.maximum(np.diag(gram)[1:], 1e-300))
    centre, width = np.array([_prior(balance.terms[name].centre, balance.terms[name].spread, r)
                              for name, r in zip(names, reach, strict=True)]).T

    free_fit = np.linalg.lstsq(gram[1:, 1:], gram[1:, 0], rcond=1e-9)[0]
    starts = [centre, np.where(free_fit > 0.0, np.log(np.maximum(free_fit, 1e-300)), centre - 3)]
    nats, x = min((_descended(gram, balance.open, centre, width,
                              np.clip(start, centre - 12, centre + 12))
                   for start in starts), key=lambda one: one[0])
    factor = np.concatenate([[-1.0], np.exp(x)])
    return Closed(nats, max(float(factor @ gram @ factor), 0.0),
                  dict(zip(names, factor[1:].tolist(), strict=True)),
                  0.5 * SAMPLES * float(np.log(balance.open)))


def _descended(gram: np.ndarray, least: float, centre: np.ndarray, width: np.ndarray,
               x: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the least nats from a start, and where, by damped Gauss-Newton steps."""
    weight, damping = 1.0 / width**2, 1e-2

    def at(x: np.ndarray) -> tuple[float, float, np.ndarray, np.ndarray]:
        factor = np.concatenate([[-1.0], np.exp(x)])
        pull = gram @ factor
        left = max(float(factor @ pull), 0.0) + least
        nats = 0.5 * SAMPLES * np.log(left) + 0.5 * float(weight @ (x - centre)**2)
        return nats, left, factor[1:], pull[1:]

    nats, left, factor, pull = at(x)
    for _ in range(STEPS):
        slope = SAMPLES * factor * pull / left + weight * (x - centre)
        bend = SAMPLES * factor[:, None] * gram[1:, 1:] * factor / left + np.diag(weight)
        step = np.linalg.solve(bend + damping * np.diag(np.diag(bend)), slope)
        tried = np.clip(x - np.clip(step, -2.0, 2.0), centre - 15.0, centre + 15.0)
        found = at(tried)
        if found[0] < nats:
            done = nats - found[0] < ENOUGH
            x, (nats, left, factor, pull), damping = tried, found, damping / 5.0
            if done:
                break
        else:
            damping *= 10.0
            if damping > 1e8:
                break
    return float(nats), x


def _prior(centre: float, spread: float, reach: float) -> tuple[float, float]:
    """Return mean and spread of a logarithm; without a centre, a tenth of what is seen."""
    return np.log(centre if centre > 0.0 else 0.1 / reach), spread
