"""
The online estimator: samples in, slowly varying quantities of the servo file out.

It tracks what the servo file has of: the level of Coulomb friction, the slope of viscous friction,
the backlash of the transmission (`backlash`), and the gain of a drive that sets a current. Other
friction of the servo file, such as its variation over the turn, is not taken out: the level then
is that of its mean over the time constant.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.joined_samples import CHANNELS

from .equation_samples import Filtered, Filters
from .recursive_least_squares import Tracker
from .reversals import Reversals

WINDOW = 0.04  # s, of the filters
BLOCK = 0.1  # s that one row stands for
FLANK = 4.0  # N m that make a flank
SLOWEST = 0.01
"""rad/s at the load below which a shaft counts as not turning: presliding is no friction level."""
_LEAST_COMMAND = 0.05  # V rms, of the drive's gain
_FIRST_PLAY, _FIRST_CURRENT = 1e-5, 1e-3  # rad, A: deviations of a row, as first guesses
_FRICTION = {'coulomb_friction': 'level', 'viscous_friction': 'slope'}


@dataclass(frozen=True)
class Snapshot:
    """
    What is known after sample number ``sequence``: ``names`` are paths of the servo file.

    ``values`` and ``std`` in the units of the paths; ``bounded`` where a value stands at a bound;
    ``rows`` how much went in. All of shape (p,).
    """

    sequence: int
    names: tuple[str, ...]
    values: np.ndarray
    std: np.ndarray
    bounded: np.ndarray
    rows: np.ndarray


class OnlineEstimator:
    """
    Tracks the quantities of one servo from joined samples every ``period`` s.

    ``time_constant`` s may be changed at any time. A servo without any of the quantities has no
    ``names``.
    """

    def __init__(self, servo: Servo, period: float, time_constant: float = 60.0) -> None:
        self.time_constant = time_constant
        self.period = period
        half = max(3, round(0.5 * WINDOW / period))
        places = [placed for placed in servo.effects if placed.effect.name in _FRICTION]
        sites = [placed.site for placed in places]
        site = 'motor' if sites and sites[0] == 'motor' else 'load'
        self._filters = Filters(servo, period, site, half)
        self._slowest = SLOWEST * (servo.values['mechanism.ratio'] if site == 'motor'
                                   and self._filters.balance == 'motor' else 1.0)
        self._block = max(2 * half, round(BLOCK / period))
        self._reversals = Reversals(period, FLANK)
        declared = dict(servo.declarations())
        self._groups: dict[str, tuple[tuple[str, ...], Tracker]] = {}

        def group(name: str, paths: list[str], floor: float) -> None:
            if paths:
                start = [servo.values[path] for path in paths]
                self._groups[name] = (tuple(paths), Tracker(
                    start, [max(abs(value), 1e-9) for value in start],
                    [_bounds(servo, declared[path].bounds, path) for path in paths], floor))

        friction = {kind: next((p for p in places if p.effect.name == kind
                                and p.site == sites[0]), None) for kind in _FRICTION}
        self._kinds = [kind for kind, placed in friction.items() if placed]
        group('friction', [f'effects.{friction[kind].name}.{_FRICTION[kind]}'
                           for kind in self._kinds],
              self._filters.friction_noise)
        group('gap', [f'effects.{placed.name}.width' for placed in servo.effects
                      if placed.effect.name == 'backlash'][:1], _FIRST_PLAY)
        group('gain', ['drive.gain'] * self._filters.drives, _FIRST_CURRENT)
        self.names = tuple(path for paths, _ in self._groups.values() for path in paths)
        self._since_play = 0.0
        self._rows = np.empty((0, len(CHANNELS)))
        self._next: int | None = None

    @property
    def needs(self) -> dict[str, tuple[str, ...]]:
        """Channels that each quantity is seen by."""
        of = {'friction': self._filters.channels, 'gain': ('voltage', 'current'),
              'gap': ('motor_position', 'load_position', 'torque')}
        return {path: of[group] for group, (paths, _) in self._groups.items() for path in paths}

    def push(self, sequence: int, samples: np.ndarray) -> None:
        """Take joined samples (n, len(CHANNELS)), the first with number ``sequence``."""
        if self._next is not None and sequence != self._next:
            self._rows = self._rows[:0]
            self._reversals.forget()
        self._next = sequence + len(samples)
        self._rows = np.vstack([self._rows, samples])
        need = self._block + 2 * self._filters.half
        while len(self._rows) >= need:
            self._take(self._filters.run(self._rows[:need]))
            self._rows = self._rows[self._block:]

    def snapshot(self) -> Snapshot:
        """Return what is known now."""
        trackers = [tracker for _, tracker in self._groups.values()]

        def joined(pieces: list) -> np.ndarray:
            return np.concatenate(pieces) if pieces else np.empty(0)

        return Snapshot(
            (self._next or 0) - 1, self.names, joined([t.values.copy() for t in trackers]),
            joined([t.std for t in trackers]), joined([t.bounded for t in trackers]),
            joined([np.full(len(t.values), t.rows) for t in trackers]))

    def _take(self, block: Filtered) -> None:
        seconds = self._block * self.period
        if 'friction' in self._groups:
            way = np.sign(block.speed[0])
            turning = (way * block.speed > self._slowest).all()
            friction = float(block.friction.mean())
            if turning and np.isfinite(friction):
                row = {'coulomb_friction': way, 'viscous_friction': float(block.speed.mean())}
                self._groups['friction'][1].take([row[kind] for kind in self._kinds], friction,
                                                 seconds, self.time_constant)
        if 'gain' in self._groups:
            power = float(block.voltage @ block.voltage) / len(block.voltage)
            if power > _LEAST_COMMAND ** 2 and np.isfinite(block.current).all():
                size = power ** 0.5
                answer = float(block.voltage @ block.current) / len(block.voltage) / size
                self._groups['gain'][1].take([size], answer, seconds, self.time_constant)
        if 'gap' in self._groups:
            self._since_play += seconds
            for play in self._reversals.take(block.wind_up, block.torque, block.load):
                elapsed = min(self._since_play, self.time_constant)
                self._groups['gap'][1].take([1.0], play, elapsed, self.time_constant)
                self._since_play = 0.0


def _bounds(servo: Servo, declared: tuple[float, float], path: str) -> tuple[float, float]:
    """Return the bounds of a declaration, cut by what the servo file allows."""
    low, high = servo.tolerance.get(path, (-inf, inf))
    return max(low, declared[0]), min(high, declared[1])
