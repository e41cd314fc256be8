"""How large things are on this machine: speeds, torques, travels; what unknown shapes to try."""

from __future__ import annotations

from itertools import product

import numpy as np

from servo_twin.physics.effect import Effect, Parameter

from .balance import Balance

SHARES = {
    'rad/s': (0.02, 0.07, 0.2),
    'N m': (0.15, 0.5, 1.5),
    'A': (0.2, 0.5, 1.0),
    'V': (0.05, 0.1, 0.2, 0.4, 0.6, 0.75, 0.9),
    's': (0.1, 0.3),
}
"""Shares of what a machine reached that are tried for a shape in that unit."""
WIND_UPS = (0.15, 0.5, 1.5)  # shares of the wind-up that are tried for a shape of the mesh
STROKES = (0.002, 0.05)  # of the smallest and the largest stroke, between which bristles are tried
LEAST_STROKE = 1e-3  # of the largest: a recording that moves less does not move
APART = 5.0  # times by which one of these is larger than the last
PLACES = tuple(k / 6 for k in range(7))  # of the travel of a shaft; half as many miss a spring
FREQUENCIES = tuple(float(f) for f in np.geomspace(0.01, 0.4, 49))
"""Shares of the bump's own pass band: 8 % apart, or a resonance would lie unseen between two."""
LARGEST_ORDER = 200
PART = 0.35  # of a period that a shaft must cover for a transmission error of that order


def is_place(parameter: Parameter) -> bool:
    """Tell whether a shape says where on its way a shaft is, and not how far or how much."""
    return parameter.unit == 'rad' and parameter.bounds[0] < 0.0 and bool(parameter.grid)


class Scales:
    """What the recordings reached: by unit and site, the largest value that is not an outlier."""

    def __init__(self, balances: list[Balance]) -> None:
        self.balances = balances

    def reached(self, name: str) -> float:
        """Return the 98th percentile of the size of a motion column, 0 where it is not there."""
        sizes = [np.abs(one.motion(name)) for one in self.balances]
        tops = [np.nanpercentile(size, 98) for size in sizes if np.isfinite(size).any()]
        return float(max(tops, default=0.0))

    def wind_up(self) -> float:
        """Return the size of the wind-up, rad."""
        return self.reached('wind_up')

    def travelled(self) -> tuple[float, float]:
        """Return the lowest and highest angle of the load shaft, rad."""
        angles = [one.motion('load_angle') for one in self.balances]
        return float(min(a.min() for a in angles)), float(max(a.max() for a in angles))

    def strokes(self, site: str) -> tuple[float, float]:
        """Return the smallest and the largest travel of a shaft in a recording, rad."""
        name = 'motor_angle' if site == 'motor' else 'load_angle'
        travels = np.array([np.ptp(one.motion(name)) for one in self.balances])
        largest = float(np.max(travels))
        return float(np.min(travels[travels >= LEAST_STROKE * largest])), largest

    def grid(self, effect: type[Effect], site: str) -> list[dict[str, float]]:
        """Combinations of shape values worth trying for an effect, orders left out."""
        choices = {}
        for name in effect.shapes():
            parameter = effect.parameters[name]
            if parameter.row or name == 'order':
                continue
            choices[name] = self._values(parameter, effect, site) if parameter.grid else (
                float(parameter.default),)
        names = list(choices)
        return [dict(zip(names, values, strict=True)) for values in product(*choices.values())]

    def _values(self, parameter, effect, site) -> tuple[float, ...]:
        unit = parameter.unit
        if is_place(parameter):
            low, high = self.travelled()
            return tuple(low + s * (high - low) for s in PLACES)
        if unit == 'rad' and effect.port in ('mesh', 'clearance'):
            size, shares = self.wind_up(), WIND_UPS
        elif unit == 'rad':
            size, shares = 1.0, self._bristles(site)
        elif unit == 'Hz':
            bumps = [b.seen.bump for b in self.balances]
            size, shares = max(0.5 / (b.spacing * b.period) for b in bumps), FREQUENCIES
        elif unit == 's' and 'time' not in effect.variables():
            return parameter.grid  # its own time, which no recording's length tells
        elif unit in SHARES:
            size, shares = self._size(unit, site), SHARES[unit]
        else:
            return parameter.grid
        values = tuple(float(np.clip(size * s, *parameter.bounds)) for s in shares)
        return values if values and size > 0.0 else parameter.grid

    def _bristles(self, site: str) -> list[float]:
        """Return travels after a reversal, rad, within which friction may build up."""
        low, high = (s * stroke for s, stroke in zip(STROKES, self.strokes(site), strict=True))
        if not low > 0.0:
            return []
        steps = int(np.ceil(np.log(high / low) / np.log(APART)))
        return np.geomspace(low, high, steps + 1).tolist()

    def _size(self, unit: str, site: str) -> float:
        if unit == 'rad/s':
            return self.reached('motor_speed' if site == 'motor' else 'load_speed')
        if unit == 'N m':
            ratio = self.balances[0].servo.values['mechanism.ratio']
            return self.reached('torque') / (ratio if site == 'motor' else 1.0)
        if unit == 'A':
            return self.reached('current')
        if unit == 'V':
            return max(float(np.percentile(np.abs(b.seen.voltage), 99.5)) for b in self.balances)
        return max(b.seen.recording.duration for b in self.balances)


def orders(angle: np.ndarray, residual: np.ndarray, most: int = 3,
           least: float = 1.0, multiples: int = 1) -> tuple[float, ...]:
    """
    Return the orders (1/rad) of a shaft at which a residual is periodic, strongest first.

    ``angle`` in rad and ``residual`` of the same shape; NaN is left out. An order is tried when
    the shaft covers at least so much of its period, ``least``; of two that it cannot tell apart
    the stronger one. Least squares at each order, beside a constant, so that the samples need not
    be even in angle. Of a law that has up to so many ``multiples`` of its order, the strongest
    may be one of them: the orders of which it can be follow.
    """
    good = np.isfinite(angle) & np.isfinite(residual)
    if good.sum() < 50:
        return ()
    angle, residual = angle[good], residual[good] - np.mean(residual[good])
    whole = 2.0 * np.pi / max(float(np.ptp(angle)), 1e-12)  # order of one period on the way
    lowest, apart = max(1, int(np.ceil(least * whole))), max(1.0, whole)
    if lowest > LARGEST_ORDER:
        return ()
    tried = np.arange(lowest, LARGEST_ORDER + 1)
    turn = np.exp(1j * angle)
    wave = turn ** lowest
    strength = np.empty(len(tried))
    for i in range(len(tried)):
        mean, twice, taken = np.mean(wave), np.mean(wave * wave), np.mean(residual * wave)
        shared = 0.5 * twice.imag - mean.real * mean.imag  # covariances of cosine and sine
        spread = np.array([[0.5 + 0.5 * twice.real - mean.real**2, shared],
                           [shared, 0.5 - 0.5 * twice.real - mean.imag**2]])
        both = np.array([taken.real, taken.imag])
        strength[i] = both @ np.linalg.pinv(spread, rcond=1e-6) @ both
        wave = wave * turn
    best = []
    for i in np.argsort(strength)[::-1]:
        if all(abs(tried[i] - b) > apart for b in best):
            best.append(tried[i])
        if len(best) == most:
            break
    parts = {best[0] // n for n in range(2, multiples + 1) if best[0] % n == 0}
    best += sorted({one for one in parts if one >= lowest}.difference(best), reverse=True)
    return tuple(float(b) for b in best)
