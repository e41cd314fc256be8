"""How unsure the starts of the horizons are before anything is fitted."""

from __future__ import annotations

import numpy as np

from .shooting import Shooting


def start_deviations(shooting: Shooting) -> tuple[np.ndarray, np.ndarray]:
    """Return steps for differences and prior deviations of the starts, (horizons, offsets)."""
    prior = []
    compliance = shooting.compliance()
    for course in shooting.courses:
        ratio = shooting.servo.values['mechanism.ratio']
        floors = [course.noise[1], course.noise[0] / ratio]
        floor = max(f for f in floors if np.isfinite(f))
        own = course.begin[:, 3] if np.isfinite(course.begin[:, 3]).any() else (
            course.begin[:, 2] / ratio)
        cutoff = 2.0 * np.pi * min(50.0, 0.2 / course.period)
        wind_up = 3.0 * floor + 0.5 * course.begin[:, 7] * compliance
        deviations = (2.0 * floor + np.abs(own) * course.period,
                      floor * cutoff + 0.5 * course.begin[:, 6], wind_up, wind_up * cutoff)
        prior.append(np.column_stack(deviations[:shooting.offsets]))
    prior = np.maximum(np.concatenate(prior), 1e-12)
    return 0.1 * prior, prior
