"""What each model makes of a recording of the feed drive, and of a circle of two axes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from servo_twin.recording.recording import Recording

RADIUS = 0.05  # m, which the paper does not give; 120 rad/min are F6000 on it
PERIOD = 1e-3
SETTLED = 1.0  # s left out at the beginning of the circle


class Judged:
    """One recording and what each model makes of its wanted place: places of the table, m."""

    def __init__(self, recording: Recording, predicted: Mapping[str, np.ndarray]) -> None:
        self.time = np.arange(len(recording)) * recording.period
        self.wanted = recording['reference_position']
        self.measured = recording['load_position']
        self.predicted = dict(predicted)

    def figures(self, rows: slice = slice(None)) -> dict[str, dict[str, float]]:
        """
        Return the errors of table 3 of each model, in um and percent.

        The relative one is the largest error over the largest measured tracking error, which is
        what the numbers of the paper's table are.
        """
        tracking = np.max(np.abs(self.measured - self.wanted)[rows])
        figures = {}
        for model, place in self.predicted.items():
            error = (place - self.measured)[rows]
            figures[model] = {'largest': 1e6 * float(np.max(np.abs(error))),
                              'rmse': 1e6 * float(np.sqrt(np.mean(error**2))),
                              'relative': 100.0 * float(np.max(np.abs(error)) / tracking)}
        return figures


class Circle:
    """Two axes on a circle: places and contour errors, m, of the rig and of each model."""

    def __init__(self, x: Judged, y: Judged) -> None:
        size = min(len(x.time), len(y.time))
        rows = slice(round(SETTLED / PERIOD), size)
        self.time = x.time[rows]
        self.angle = np.unwrap(np.arctan2(y.wanted[rows], x.wanted[rows] + RADIUS))
        places = {'measured': (x.measured, y.measured)} | {
            model: (x.predicted[model], y.predicted[model]) for model in x.predicted}
        self.contour = {name: np.hypot(px[rows] + RADIUS, py[rows]) - RADIUS
                        for name, (px, py) in places.items()}

    def figures(self) -> dict[str, dict[str, float]]:
        """Return the largest error and the RMSE of each model's contour error, um (table 4)."""
        real = self.contour['measured']
        figures = {'measured': {'largest': 1e6 * float(np.max(np.abs(real)))}}
        for model in self.contour:
            if model != 'measured':
                error = self.contour[model] - real
                figures[model] = {'largest': 1e6 * float(np.max(np.abs(error))),
                                  'rmse': 1e6 * float(np.sqrt(np.mean(error**2)))}
        return figures
