"""A direct drive that its own encoder and a current sensor read: servo file and recordings."""

from collections.abc import Callable

from numba import njit
import numpy as np
from one_encoder import counted, filled, head_of
from synthetic_recordings import run_of

from servo_twin.recording.recording import Recording

PERIOD, COUNTS = 2e-3, {'motor_position': 2.0 * np.pi / 2**16}  # s, rad
FINE = 40  # steps of the integration in a period


def direct_head(name: str, constant: float, inertia: float, noise: float) -> str:
    """Return the head of its servo file; ``noise`` (A) is that of the current."""
    head = head_of(name, constant, (inertia, 0.0), 1.0, noise)
    return filled(head, 'motor_position', COUNTS, 'rigid')


def shaft(pushes: Callable[[float, float], float], constant: float, inertia: float
          ) -> Callable[[np.ndarray], np.ndarray]:
    """
    Return what integrates a shaft behind a controller of its own: (angle, current) of a goal.

    ``pushes(angle, speed)``, compiled, is the torque on the shaft beside that of the motor, N m.
    """
    @njit
    def turned(goal: np.ndarray) -> np.ndarray:
        step = PERIOD / FINE
        angle = speed = last = 0.0
        rows = np.zeros((len(goal), 2))
        for k in range(len(goal)):
            current = 9.0 * (goal[k] - angle) + 0.25 * ((goal[k] - last) / PERIOD - speed)
            last = goal[k]
            rows[k] = angle, current
            for _ in range(FINE):
                speed += step / inertia * (constant * current + pushes(angle, speed))
                angle += step * speed
        return rows

    return turned


def swung(turned: Callable[[np.ndarray], np.ndarray], swings: tuple[tuple[float, float], ...],
          noise: float, runs: int = 3, seconds: float = 14.0) -> list[Recording]:
    """
    Return recordings of a drive that follows sines of random phase.

    ``turned(goal)`` returns angle and current, (samples, 2); ``swings`` are amplitudes (rad) and
    frequencies (Hz).
    """
    time, several = np.arange(0.0, seconds, PERIOD), []
    for seed in range(1, runs + 1):
        chance = np.random.default_rng(seed)
        goal = sum(size * np.sin(2.0 * np.pi * f * time + chance.uniform(0.0, 6.0))
                   for size, f in swings)
        angle, current = turned(goal - goal[0]).T
        several.append(run_of(seed, PERIOD, {
            'motor_position': counted('motor_position', COUNTS, (angle,)), 'voltage': current,
            'current': current + noise * chance.standard_normal(len(time))}, 'moves'))
    return several
