"""What a learner is and what it gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..friction_dataset import Dataset

Told = Callable[[int, float, float], None]
"""Called with (epoch, training loss, validation loss); may raise to stop."""


@dataclass(frozen=True)
class Model:
    """
    A trained friction model.

    ``predict(dataset, rows)`` gives friction, N m, at those samples; ``size`` counts trained
    numbers; ``once()`` evaluates a single sample compiled, to be timed; ``sentence`` is the result
    as a person would write it, empty where no person can.
    """

    name: str
    predict: Callable[[Dataset, np.ndarray], np.ndarray]
    size: int
    once: Callable[[], float]
    sentence: str = ''


Learner = Callable[[Dataset, int, float, Told | None], Model]
"""Called with (dataset, seed, seconds to spend, told)."""
