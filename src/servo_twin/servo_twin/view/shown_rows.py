"""All that a view shows of a bag, on disk: a bag may be longer than the memory."""

from __future__ import annotations

import tempfile

import numpy as np

from ..recording.joined_samples import CHANNELS
from ..recording.recording import BALANCES, COMPARED, PREDICTED, Predictions, Recording
from .traces import NAMES


class ShownRows:
    """
    What was measured and answered, in the order of NAMES and of the samples.

    Four bytes a number, in a file without a name; :meth:`close` gives it up.
    """

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115  (it lives as long as the view)

    def add(self, recording: Recording, answer: Predictions | None) -> None:
        """Keep the next part, and what a twin answered to some of it; the rest is NaN."""
        rows = np.full((len(recording), len(NAMES)), np.nan, np.float32)
        for k, name in enumerate(CHANNELS):
            rows[:, k] = recording[name]
        if answer is not None:
            shift = answer.sequence - recording.sequence
            first, end = max(0, shift), min(len(recording), shift + len(answer))
            columns = [answer.prediction[name] for name in PREDICTED]
            columns += [answer.residual[name] for name in COMPARED + BALANCES]
            for k, values in enumerate(columns, len(CHANNELS)):
                rows[first:end, k] = values[first - shift:end - shift]
        rows.tofile(self._file)

    def part(self, first: int, end: int) -> np.ndarray:
        """Return samples ``first`` to ``end``, shape (len(NAMES), samples)."""
        self._file.seek(4 * len(NAMES) * first)
        found = np.fromfile(self._file, np.float32, (end - first) * len(NAMES))
        return found.reshape(-1, len(NAMES)).T

    def clear(self) -> None:
        """Forget all of it."""
        self._file.seek(0)
        self._file.truncate()

    def close(self) -> None:
        """Give the file up."""
        self._file.close()
