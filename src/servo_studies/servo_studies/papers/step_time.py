"""A servo driven through made-up inputs, and the time that a step takes it."""

from __future__ import annotations

import time

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate, substeps_of
from servo_twin.physics.state import INPUTS

TRIES = 3


def driven(**given: np.ndarray) -> np.ndarray:
    """Return inputs as simulate takes them from some of its columns, each (samples,)."""
    size = len(next(iter(given.values())))
    return inputs_of({name: np.full(size, np.nan) for name in INPUTS} | given)


def stepped(servo: Servo, u: np.ndarray, period: float, mode: str = 'measured_input'
            ) -> tuple[np.ndarray, float]:
    """
    Return what a servo answers from rest, and the processor time of a step, ns.

    The time is the least of some runs, compiling left out; ``u`` is held for ``period`` s a row.
    """
    simulate(servo, u[:2], period, initial_state(servo), mode)
    times = []
    for _ in range(TRIES):
        x, begun = initial_state(servo), time.thread_time()
        y = simulate(servo, u, period, x, mode)
        times.append(time.thread_time() - begun)
    return y, 1e9 * min(times) / (len(u) * substeps_of(servo, period)[0])
