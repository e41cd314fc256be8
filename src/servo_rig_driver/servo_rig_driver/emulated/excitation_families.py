"""
Excitation families by name: from settings to a reference and an external torque over time.

Each is one function of the instants t (s); its keyword arguments are its settings, with what suits
the bench of paper 000. References are in V, rad/s or rad by the mode, the last two at the load.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from inspect import signature
from math import log, pi

import numpy as np

Waves = tuple[np.ndarray, np.ndarray]


class ExcitationError(ValueError):
    """A family or a setting that does not exist, or a setting that makes no sense."""


@dataclass(frozen=True)
class Family:
    """One way of driving a rig: its law, the mode it is meant for and its usual duration, s."""

    name: str
    law: Callable[..., Waves]
    mode: str
    duration: float

    @property
    def settings(self) -> dict[str, float]:
        """Its settings with their defaults."""
        return {name: parameter.default
                for name, parameter in list(signature(self.law).parameters.items())[1:]}

    def waves(self, t: np.ndarray, settings: Mapping[str, float]) -> Waves:
        """
        Return reference and external torque at the instants t.

        Raises ExcitationError for a setting that the family does not have, or waves that are not
        finite.
        """
        for name in settings:
            if name not in self.settings:
                raise ExcitationError(f"{self.name} has no setting '{name}'; it has "
                                      f'{self.settings}')
        with np.errstate(all='ignore'):
            try:
                reference, external = self.law(t, **settings)
            except (ZeroDivisionError, ValueError) as error:
                raise ExcitationError(f'{self.name} with {dict(settings)}: {error}') from error
        if not (np.isfinite(reference).all() and np.isfinite(external).all()):
            raise ExcitationError(f'{self.name} with {dict(settings)} gives no finite reference')
        return reference, external


def _still(t: np.ndarray) -> np.ndarray:
    return np.zeros(len(t))


def _triangle(phase: np.ndarray) -> np.ndarray:
    return 2.0 / pi * np.arcsin(np.sin(2.0 * pi * phase))


def _eased(t: np.ndarray, speed: np.ndarray, acceleration: float) -> np.ndarray:
    """Return a speed that follows another one with a bounded acceleration, from rest."""
    most = acceleration * (t[1] - t[0] if len(t) > 1 else 0.0)
    eased, now = [], 0.0
    for wanted in speed.tolist():
        now += min(max(wanted - now, -most), most)
        eased.append(now)
    return np.array(eased)


def speed_ladder(t: np.ndarray, lowest: float = 0.01, highest: float = 1.0, steps: int = 8,
                 dwell: float = 1.5, acceleration: float = 4.0) -> Waves:
    """Give speeds from lowest to highest in equal ratios, each forwards and then backwards."""
    levels = np.geomspace(lowest, highest, int(steps))
    place = (t // dwell).astype(int) % (2 * len(levels))
    speed = np.repeat(levels, 2)[place] * np.where(place % 2, -1.0, 1.0)
    return _eased(t, speed, acceleration), _still(t)


def slow_reversals(t: np.ndarray, amplitude: float = 0.05, period: float = 4.0) -> Waves:
    """Give a triangle of speed through zero."""
    return amplitude * _triangle(t / period), _still(t)


def load_steps(t: np.ndarray, speed: float = 0.15, torque: float = 60.0, steps: int = 5,
               dwell: float = 1.0, acceleration: float = 4.0) -> Waves:
    """Give steps of external torque up and down, at a constant speed forwards, then backwards."""
    levels = np.linspace(-torque, torque, int(steps))
    place = (t // dwell).astype(int)
    cycle = np.concatenate([levels, levels[-2:0:-1]])
    way = np.where(place // len(cycle) % 2, -1.0, 1.0)
    return _eased(t, speed * way, acceleration), cycle[place % len(cycle)]


def chirp(t: np.ndarray, amplitude: float = 2.0, first: float = 0.5, last: float = 30.0,
          offset: float = 0.0) -> Waves:
    """Give a sine whose frequency, Hz, grows exponentially from first to last."""
    rate = log(last / first) / (t[-1] if len(t) > 1 else 1.0)
    phase = 2.0 * pi * first * np.expm1(rate * t) / rate if rate else 2.0 * pi * first * t
    return offset + amplitude * np.sin(phase), _still(t)


def multisine(t: np.ndarray, amplitude: float = 2.0, first: float = 0.2, last: float = 25.0,
              lines: int = 24, phases: int = 1, offset: float = 0.0) -> Waves:
    """Give sines on a grid of frequencies, Hz, with random phases; ``amplitude`` is the peak."""
    step = 0.1
    tones = np.unique(np.round(np.geomspace(first, last, int(lines)) / step)) * step
    turns = np.random.default_rng(int(phases)).random(len(tones))
    wave = np.zeros(len(t))
    for tone, turn in zip(tones, turns, strict=True):
        wave += np.sin(2.0 * pi * (tone * t + turn))
    return offset + amplitude * wave / max(np.abs(wave).max(), 1e-12), _still(t)


def hold(t: np.ndarray, reference: float = 0.0, torque: float = 60.0, period: float = 6.0
         ) -> Waves:
    """Hold still while the external torque swings as a triangle."""
    return np.full(len(t), reference), torque * _triangle(t / period)


def coast_down(t: np.ndarray, push: float = 2.2, time: float = 1.5, period: float = 4.0) -> Waves:
    """Push for a time, then let go; the next push goes the other way."""
    place = t // period
    return np.where(t % period < time, push, 0.0) * np.where(place % 2, -1.0, 1.0), _still(t)


def sine(t: np.ndarray, amplitude: float = 1.5, frequency: float = 1.0, offset: float = 0.0,
         torque: float = 0.0) -> Waves:
    """Give a sine, under a constant external torque."""
    return offset + amplitude * np.sin(2.0 * pi * frequency * t), np.full(len(t), torque)


def square(t: np.ndarray, amplitude: float = 1.8, frequency: float = 0.5, torque: float = 0.0
           ) -> Waves:
    """Give a square, positive first, under a constant external torque."""
    return np.where((t * frequency + 1e-9) % 1.0 < 0.5, amplitude, -amplitude), \
        np.full(len(t), torque)


def turns(t: np.ndarray, speed: float = 0.3, angle: float = 2.0 * pi, rest: float = 0.5,
          acceleration: float = 4.0) -> Waves:
    """Give a constant speed over an angle, a rest, the same backwards, a rest, and so on."""
    way = angle / abs(speed)
    at = t % (2.0 * (way + rest))
    forwards, backwards = at < way, (at >= way + rest) & (at < 2.0 * way + rest)
    wanted = speed * (forwards.astype(float) - backwards)
    return _eased(t, wanted, acceleration), _still(t)


def ramps(t: np.ndarray, slope: float = 0.05, angle: float = 0.2, torque: float = 30.0) -> Waves:
    """Give a position that goes up and down at a constant slope, under a constant torque."""
    period = 2.0 * angle / slope
    at = t % period
    return np.where(at < 0.5 * period, slope * at, slope * (period - at)), np.full(len(t), torque)


def multilevel_steps(t: np.ndarray, amplitude: float = 1.8, levels: int = 9, dwell: float = 0.5,
                     order: int = 1) -> Waves:
    """
    Give steps to levels in equal distances from -amplitude to amplitude, each held for a time.

    Every level comes once before one comes again; ``order`` chooses in which order.
    """
    steps = np.linspace(-amplitude, amplitude, int(levels))
    place = (t // dwell).astype(int)
    draw = np.random.default_rng(int(order))
    rounds = place.max(initial=0) // len(steps) + 1
    return np.concatenate([draw.permutation(steps) for _ in range(rounds)])[place], _still(t)


def sinusoids(t: np.ndarray, amplitude: float = 1.8, first: float = 0.2, last: float = 2.0,
              steps: int = 5, dwell: float = 5.0) -> Waves:
    """
    Give one sine after the other, larger each time up to the amplitude, without a jump of phase.

    Their frequencies, Hz, go from first to last in equal ratios, and back in the next round.
    """
    count = int(steps)
    tones, sizes = np.geomspace(first, last, count), np.linspace(amplitude / count, amplitude,
                                                                 count)
    place = (t // dwell).astype(int)
    at, back = place % count, place // count % 2 == 1
    tone = np.where(back, tones[::-1][at], tones[at])
    phase = np.cumsum(tone) * (t[1] - t[0] if len(t) > 1 else 0.0)
    return sizes[at] * np.sin(2.0 * pi * phase), _still(t)


def feed_sine(t: np.ndarray, amplitude: float = 0.1, speed: float = 0.1, ease: float = 0.5
              ) -> Waves:
    """Give a sine of place whose largest speed is ``speed``, reached within ``ease`` seconds."""
    x = np.clip(t / ease, 0.0, 1.0)
    since = np.where(t < ease, ease * x**3 * (1.0 - 0.5 * x), t - 0.5 * ease)
    return amplitude * np.sin(speed / amplitude * since), _still(t)


FAMILIES = {law.__name__: Family(law.__name__, law, mode, duration) for law, mode, duration in (
    (speed_ladder, 'velocity', 24.0), (slow_reversals, 'velocity', 16.0),
    (load_steps, 'velocity', 16.0), (chirp, 'voltage', 20.0), (multisine, 'voltage', 20.0),
    (hold, 'velocity', 12.0), (coast_down, 'voltage', 16.0), (sine, 'voltage', 10.0),
    (square, 'voltage', 10.0), (turns, 'velocity', 44.0), (ramps, 'position', 16.0),
    (feed_sine, 'position', 20.0), (multilevel_steps, 'voltage', 18.0),
    (sinusoids, 'voltage', 25.0))}


def family(name: str) -> Family:
    """Return a family; raises ExcitationError that names what there is."""
    try:
        return FAMILIES[name]
    except KeyError:
        raise ExcitationError(f"no excitation family '{name}'; there are "
                              f'{list(FAMILIES)}') from None
