"""Transmission error as harmonics of the load's turn, forward and reverse (paper 000 eq. 12)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from math import gcd

import numpy as np

from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed, Provenance, Servo
from servo_twin.recording.recording import Recording

from ...fit.estimate import bag_name
from ..error_scores import Scores, scores_of
from .order_spectrum import amplitudes, dominant, invariance, rebuilt
from .turn_passes import Pass, passes_of

ARCMIN = np.pi / 180.0 / 60.0
LOW = 8  # highest order that can be backlash and not tooth meshing


@dataclass(frozen=True)
class LearnedError:
    """
    Harmonics of both directions.

    ``orders`` of the load's turn, largest first; ``forward`` and ``reverse`` complex amplitudes,
    rad, for cosine minus sine parts; ``steadiness`` by order: 1 where amplitude and phase are the
    same at every speed; ``scores`` (arcmin) of each direction on the pass that was kept back.
    """

    orders: tuple[int, ...]
    forward: np.ndarray
    reverse: np.ndarray
    steadiness: dict[int, float]
    scores: tuple[Scores, Scores]
    speeds: tuple[float, ...]
    bags: tuple[str, ...]

    def sentences(self) -> list[str]:
        """Say what was found."""
        told = [f'{len(self.orders)} orders repeat: '
                + ', '.join(f'{o} ({abs(self.forward[i]) / ARCMIN:.4f}/'
                            f'{abs(self.reverse[i]) / ARCMIN:.4f} arcmin, '
                            f'invariance {self.steadiness[o]:.3f})'
                            for i, o in enumerate(self.orders[:12]))]
        told += [f'{way}: MSE {s.mse:.7f} arcmin2 on a pass kept back'
                 for way, s in zip(('forward', 'reverse'), self.scores, strict=True)]
        return told


def learned_error(servo: Servo, recordings: list[Recording], cells: int = 720) -> LearnedError:
    """
    Find the orders that repeat and their amplitudes by direction.

    Raises ValueError where no direction has whole turns.
    """
    passes = [p for p in passes_of(servo, recordings, cells) if p.covered > 0.98]
    ways = [[p for p in passes if p.forward is way] for way in (True, False)]
    if not all(ways):
        raise ValueError('transmission error needs whole turns at constant speed in both '
                         f'directions; there are {len(ways[0])} forward, {len(ways[1])} reverse')
    shapes = [[_zero_mean(p) for p in way] for way in ways]
    # one of each direction is kept back to be predicted
    learn = [s[:-1] if len(s) > 1 else s for s in shapes]
    orders = list(dict.fromkeys(o for s in learn for o in dominant(s)))
    spectra = [np.mean([amplitudes(x) for x in s], axis=0) for s in learn]
    orders.sort(key=lambda o: -abs(spectra[0][o]) - abs(spectra[1][o]))
    scores = tuple(scores_of(s[-1] / ARCMIN, rebuilt(c, orders, cells) / ARCMIN)
                   for s, c in zip(shapes, spectra, strict=True))
    steady = [invariance(s, orders) for s in shapes]
    final = [np.mean([amplitudes(x) for x in s], axis=0)[orders] for s in shapes]
    return LearnedError(tuple(orders), *final, {o: min(s[o] for s in steady) for o in orders},
                        scores, tuple(sorted({round(p.speed, 4) for p in passes})),
                        tuple(bag_name(r) for r in recordings))


def _zero_mean(one: Pass) -> np.ndarray:
    shape = one.lost - np.nanmean(one.lost)
    grid = np.arange(len(shape))
    known = np.isfinite(shape)
    return np.interp(grid, grid[known], shape[known], period=len(shape))


def with_error(servo: Servo, learned: LearnedError) -> Servo:
    """
    Return the servo with its transmission errors replaced by the learned harmonics.

    Orders that are multiples of a common base above 1 go into one effect, the others into
    another of base order 1; a row holds every multiple up to the last. Where the servo has a
    learned gap, see :func:`gap_takes_low_orders`.
    """
    high = [o for o in learned.orders if o > 8]
    base = reduce(gcd, high) if high else 0
    groups = {}
    if base > 8:
        groups['teeth'] = (base, high)
        low = [o for o in learned.orders if o <= 8]
    else:
        low = list(learned.orders)
    if low:
        groups['turn'] = (1, low)
    placed, values, provenance = [], {}, {}
    source = Provenance('order spectra of turns, paper 000 eq. 12', None, learned.bags)
    for name, (order, members) in groups.items():
        size = max(members) // order
        rows = np.zeros((4, size))
        for o in members:
            i = learned.orders.index(o)
            ahead, back = learned.forward[i], learned.reverse[i]
            rows[:, o // order - 1] = (ahead.real, ahead.imag, (back - ahead).real,
                                       (back - ahead).imag)
        label = f'{name}_error'
        placed.append(Placed(label, find('transmission_error'), 'mesh'))
        values[f'effects.{label}.order'] = float(order)
        parts = ('cosine', 'sine', 'cosine_change', 'sine_change')
        for part, row in zip(parts, rows, strict=True):
            values[f'effects.{label}.{part}'] = tuple(float(v) for v in row)
            provenance[f'effects.{label}.{part}'] = source
    bare = servo.without_effects(lambda other: other.effect.name == 'transmission_error')
    return gap_takes_low_orders(bare.with_effects(*placed, values=values, provenance=provenance))


def gap_takes_low_orders(servo: Servo) -> Servo:
    """
    Return the servo whose transmission error is the same both ways in orders that a gap has.

    Forward less reverse is measured once but could be told twice: by the gap, which varies over
    the turn, and by harmonics that change with the direction. Where there is a learned gap its
    low orders carry the difference, and the harmonics keep the mean (paper 000 section 3.2 on
    spectral duplication).
    """
    if 'network_backlash' not in {p.effect.name for p in servo.effects}:
        return servo
    values = dict(servo.values)
    for placed in servo.effects:
        if placed.effect.name != 'transmission_error':
            continue
        path = f'effects.{placed.name}'
        low = int(LOW / values[f'{path}.order'])
        for part in ('cosine', 'sine'):
            row = np.array(values[f'{path}.{part}'])
            change = np.array(values[f'{path}.{part}_change'])
            row[:low] += 0.5 * change[:low]
            change[:low] = 0.0
            values[f'{path}.{part}'] = tuple(row.tolist())
            values[f'{path}.{part}_change'] = tuple(change.tolist())
    return replace(servo, values=values)
