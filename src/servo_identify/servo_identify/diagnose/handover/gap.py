"""How far a twin is from its rig over recordings, and by how much one is nearer than another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..decisions import CALIBRATED, FORM

DRAWS = 400  # of blocks, behind an interval


@dataclass(frozen=True)
class Gap:
    """
    Errors of a twin over recordings: sums of squares by channel and block.

    ``squares`` maps a channel to (blocks, 2): sum of squared errors and number of samples;
    ``floor`` to its noise and ``signal`` to how much it moves, in its unit; ``recording``
    (blocks,) is the recording of each block.
    """

    squares: dict[str, np.ndarray]
    floor: dict[str, float]
    signal: dict[str, float]
    recording: np.ndarray

    def rms(self, channel: str, blocks: np.ndarray | None = None) -> float:
        """Root mean square error of a channel, over some blocks, in its unit."""
        part = self.squares[channel] if blocks is None else self.squares[channel][blocks]
        total = part.sum(axis=0)
        return float(np.sqrt(total[0] / max(total[1], 1.0)))

    def excess(self, channel: str, blocks: np.ndarray | None = None) -> float:
        """What of it is above the calibrated floor, in the unit of the channel."""
        square = self.rms(channel, blocks)**2 - CALIBRATED * self.floor[channel]**2
        return float(np.sqrt(max(0.0, square)))

    def total(self, blocks: np.ndarray | None = None, excess: bool = True) -> float:
        """Root mean square over the channels of the error, each as a share of its own signal."""
        sizes = [(self.excess if excess else self.rms)(c, blocks) / self.signal[c]
                 for c in self.squares]
        return float(np.sqrt(np.mean(np.square(sizes)))) if sizes else 0.0

    def evidence(self, other: Gap, whole: Gap | None = None) -> float:
        """
        Return by how much the simulation speaks for another twin, nats.

        Blocks count as observations, and all channels together as one: they show the same motion.
        Of two forms of what closes a gap (``whole``) it does not matter which leaves less, where
        both leave no more than noise, or than the best form of an effect may be off.
        """
        least = {c: max(FORM * whole.rms(c), np.sqrt(CALIBRATED) * self.floor[c])
                 if whole else 1e-300 for c in self.squares}
        ratios = [max(self.rms(c), least[c]) / max(other.rms(c), least[c])
                  for c in self.squares]
        nearer = float(np.mean(np.log(np.maximum(ratios, 1e-300)))) if ratios else 0.0
        return len(self.recording) * nearer

    def noise(self) -> float:
        """Return the noise floor in the same measure as :meth:`total`."""
        sizes = [self.floor[c] / self.signal[c] for c in self.squares]
        return float(np.sqrt(np.mean(np.square(sizes)))) if sizes else 0.0


def shrink(before: Gap, after: Gap, blocks: np.ndarray | None = None) -> float:
    """Return 1 - after / before of the gap above the noise floor."""
    first = before.total(blocks)
    return 1.0 - after.total(blocks) / first if first > 0.0 else 0.0


def shrink_interval(before: Gap, after: Gap) -> tuple[float, float]:
    """Return the 90 % interval of the shrink: recordings resampled, and blocks within each."""
    chance, values = np.random.default_rng(0), []
    several = [np.flatnonzero(before.recording == n) for n in np.unique(before.recording)]
    for _ in range(DRAWS):
        drawn = chance.integers(0, len(several), len(several))
        blocks = np.concatenate([chance.choice(several[n], len(several[n])) for n in drawn])
        values.append(shrink(before, after, blocks))
    low, high = np.percentile(np.array(values) - np.median(values), (5, 95))
    whole = shrink(before, after)
    return float(whole + low), float(min(1.0, whole + high))
