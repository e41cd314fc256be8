"""Blocks of samples that wait for a twin: one by one in time, joined where it falls behind."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

JOINS_FROM = 0.5  # s of waiting samples from which blocks are joined
LARGEST = 1000  # samples in a joined block
MOST = 4096  # samples answered at once, the most that a driver sends; a signal waits no longer


@dataclass(frozen=True)
class Block:
    """Samples (n, len(CHANNELS)) from ``sequence`` on, ``stamp`` ns the first, ``period`` s."""

    sequence: int
    stamp: int
    period: float
    samples: np.ndarray


class WaitingBlocks:
    """
    Holds what has come and is not answered.

    ``joined`` counts the blocks that were made part of a larger one, ``left_out`` the samples that
    were never answered because the twin was too far behind, ``worst`` the most seconds of samples
    that waited since it was set to 0.
    """

    def __init__(self) -> None:
        self.joined = self.left_out = 0
        self.behind, self.worst = 0.0, 0.0
        self._blocks: deque[Block] = deque()

    def put(self, block: Block) -> None:
        """Let a block wait, in parts of MOST samples."""
        for first in range(0, max(1, len(block.samples)), MOST):
            self._blocks.append(Block(
                block.sequence + first, block.stamp + round(first * block.period * 1e9),
                block.period, block.samples[first:first + MOST]))

    @property
    def samples(self) -> int:
        """Number of samples that wait."""
        return sum(len(block.samples) for block in self._blocks)

    def take(self, limit: float) -> list[Block]:
        """
        Return what waits, in order and in as few blocks as the lag makes worth it.

        Of more than ``limit`` s of samples only the newest block is kept, and the rest left out.
        """
        blocks = list(self._blocks)
        self._blocks.clear()
        self.behind = sum(len(block.samples) * block.period for block in blocks)
        self.worst = max(self.worst, self.behind)
        if self.behind > limit:
            self.left_out += sum(len(block.samples) for block in blocks[:-1])
            return blocks[-1:]
        return self._together(blocks) if self.behind > JOINS_FROM else blocks

    def _together(self, blocks: list[Block]) -> list[Block]:
        rows: list[list[Block]] = []
        size = 0
        for block in blocks:
            last = rows[-1][-1] if rows else None
            if last is not None and size + len(block.samples) <= LARGEST and (
                    last.sequence + len(last.samples) == block.sequence
                    and last.period == block.period):
                rows[-1].append(block)
                size += len(block.samples)
            else:
                rows.append([block])
                size = len(block.samples)
        self.joined += len(blocks) - len(rows)
        return [Block(row[0].sequence, row[0].stamp, row[0].period,
                      np.vstack([block.samples for block in row])) for row in rows]
