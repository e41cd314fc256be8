"""What each candidate would move, at a size that matters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .candidates import Candidate
from .gains_off import gains_off
from .side_by_side import side_by_side
from .signature_cache import SignatureCache
from .stack import Stack


@dataclass
class Library:
    """
    Candidates with their columns, aligned: rows of the stack.

    ``tables`` is empty once a screening has taken the columns in: they are large.
    """

    candidates: list[Candidate]
    tables: list[np.ndarray]
    amplitudes: list[np.ndarray]


def build_library(stack: Stack, candidates: list[Candidate],
                  tick: Callable[[float], None]) -> Library:
    """Compute what each candidate would move; candidates that move nothing are left out."""
    kept, tables, amplitudes = [], [], []
    size = np.sqrt(np.mean(stack.base**2)) if len(stack.base) else 0.0
    size = max(float(size), 0.3)
    cache = SignatureCache(stack) if candidates else None

    def signature(candidate):
        known = cache.get(candidate, size)
        if known is None:
            known = _scaled(stack, candidate, size)
            cache.put(candidate, size, *known)
        return known

    pairs = zip(candidates, side_by_side(signature, candidates), strict=True)
    for number, (candidate, (table, amplitude)) in enumerate(pairs):
        moving = np.sqrt(np.mean(table**2, axis=0)) * np.abs(amplitude) > 1e-6
        if moving.any():
            members = np.flatnonzero(moving)
            kept.append(_only(candidate, members))
            tables.append(table[:, members])
            amplitudes.append(amplitude[members])
        tick((number + 1) / len(candidates))
    return Library(kept, tables, amplitudes)


def _only(candidate: Candidate, members: np.ndarray) -> Candidate:
    return Candidate(candidate.name, candidate.site, tuple(candidate.paths[i] for i in members),
                     tuple(candidate.elements[i] for i in members), candidate.shapes,
                     candidate.switch, candidate.effect)


def _scaled(stack: Stack, candidate: Candidate, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Columns taken at amplitudes that move the residuals by about as much as is left in them."""
    if all(path.startswith('controller.') for path in candidate.paths):
        amplitudes = gains_off(stack, candidate.paths)
        return stack.columns(candidate, amplitudes), amplitudes
    amplitudes = np.array([_first_guess(stack, path, e) for path, e in
                           zip(candidate.paths, candidate.elements, strict=True)])
    for _ in range(3):
        table = stack.columns(candidate, amplitudes)
        moved = np.sqrt(np.mean(table**2, axis=0)) * np.abs(amplitudes)
        factor = np.where(moved > 1e-9, size / np.maximum(moved, 1e-9), 30.0)
        if np.all((factor > 0.5) & (factor < 2.0)):
            break
        bounds = [stack.extended.declaration(p).bounds for p in candidate.paths]
        start = np.array([stack.extended.theta[stack.extended.slot(p, e)] for p, e in
                          zip(candidate.paths, candidate.elements, strict=True)])
        low = np.array([b[0] for b in bounds]) - start
        high = np.array([b[1] for b in bounds]) - start
        amplitudes = np.clip(amplitudes * np.clip(factor, 1e-3, 1e3), low, high)
        amplitudes = np.where(amplitudes == 0.0, 1e-6, amplitudes)
    return table, amplitudes


def _first_guess(stack: Stack, path: str, element: int) -> float:
    extended = stack.extended
    value = extended.theta[extended.slot(path, element)]
    if abs(value) > 0.0:
        return 0.05 * abs(value)
    declared = extended.declaration(path).default
    if isinstance(declared, tuple):
        declared = max(abs(d) for d in declared)
    return abs(declared) or 1.0
