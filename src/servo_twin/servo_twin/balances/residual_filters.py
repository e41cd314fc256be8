"""Where the rig departs from its twin: the balances, filtered, as multiples of their noise."""

from __future__ import annotations

from collections.abc import Sequence

from numba import njit
import numpy as np

from ..physics.ports import Clearance
from ..physics.servo import Servo
from ..physics.state import OUTPUTS
from ..recording.joined_samples import CHANNELS, reference_of
from ..recording.recording import BALANCES, COMPARED
from .controller_law import ControllerLaw
from .equations import balance_noise, balance_taps, CONTROL, TORQUE

WINDOW = 0.04
"""Default length of the filters, s."""

_TAKEN = [CHANNELS.index(name) for name in OUTPUTS]
_COMPARED = [OUTPUTS.index(name) for name in COMPARED]
_CARRIED = CONTROL + 1  # the row of the torque that the twin's transmission carries
_TRANSMISSION = BALANCES.index('transmission')


class Balances:
    """
    The balances of one servo at one sample period, for samples in blocks of any size.

    :meth:`push` answers every sample once and in order, half a window late; how the samples are
    cut into blocks changes no bit. ``noise`` (7,) is the floor of each balance in its unit
    (recording.BALANCES), ``channel_noise`` (4,) that of the channels; NaN where the machine lacks
    a sensor for it. ``window`` in s; ``half`` is half of it in samples, at least three.

    The zeros of two encoders are arbitrary. The twin takes them from its first sample, with that
    sample's noise, and where in a gap it began shows only once the teeth carry torque. So
    `transmission` is counted from its mean so far, as far as the zeros may be off: three standard
    deviations of a sample, or any angle where the servo has a clearance. Then each sample is
    weighted by the square of the twin's torque, for within the gap it says nothing of the zeros.
    """

    def __init__(self, servo: Servo, period: float, window: float = WINDOW) -> None:
        self.half = half_of(window, period)
        self.channel_noise = np.array([servo.noise(name) for name in COMPARED])
        taps = balance_taps(servo, period, self.half)
        self.noise = balance_noise(servo, period, taps)
        self._loose = any(issubclass(one.effect, Clearance) for one in servo.effects)
        self._unsure = np.inf if self._loose else 3.0 * _of_one_sample(servo, taps, self.noise)
        with np.errstate(divide='ignore', invalid='ignore'):
            taps = taps / np.where(self.noise > 0.0, self.noise, np.nan)[:, None, None]
        pairs = [(b, c) for b in range(len(BALANCES)) for c in range(CONTROL + 1)
                 if taps[b, c].any() and np.isfinite(taps[b]).all()]
        self._pairs = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        self._taps = taps[self._pairs[:, 0], self._pairs[:, 1]]
        self._silent = ~np.isin(np.arange(len(BALANCES)), self._pairs[:, 0])
        self._law = ControllerLaw(servo, period) if reference_of(servo) else None
        self._tail = np.empty((_CARRIED + 1, 0))
        self._zero = np.zeros(2)  # sums of weight times balance, and of weight
        self._seen = 0

    def push(self, samples: np.ndarray, y: np.ndarray, breaks: Sequence[int] = ()) -> np.ndarray:
        """
        Take samples (n, len(CHANNELS)) and the twin's answer (n, len(OUTPUTS)).

        ``breaks`` are the rows that do not continue those before them (Twin.breaks). Returns the
        next answers in order, shape (m, 7), in multiples of the noise floor: one for each sample
        whose half window has passed. Beside a break, half a window is NaN on both sides.
        """
        pieces = [np.empty((0, len(BALANCES)))]
        edges = [0, *breaks, len(samples)]
        for start, end in zip(edges, edges[1:], strict=False):
            if start in breaks:
                pieces.append(self.finish())
            if end > start:
                pieces.append(self._push(samples[start:end], y[start:end]))
        return np.vstack(pieces)

    def retune(self, servo: Servo, period: float) -> None:
        """Go on with the values of another servo, keeping what was seen of the channels."""
        fresh = Balances(servo, period, 2.0 * self.half * period)
        if fresh._law and self._law:
            fresh._law.remember(self._law)
        fresh._tail, fresh._seen = self._tail, self._seen
        self.__dict__ = fresh.__dict__

    def finish(self) -> np.ndarray:
        """Return the answers still owed, which are NaN, and begin again."""
        owed = min(self._seen, self.half)
        self._tail = self._tail[:, :0]
        self._zero = np.zeros(2)
        self._seen = 0
        if self._law:
            self._law.forget()
        return np.full((owed, len(BALANCES)), np.nan)

    def whole(self, samples: np.ndarray, y: np.ndarray, breaks: Sequence[int] = ()) -> np.ndarray:
        """Answer a whole recording at once, row for row, shape (n, 7)."""
        self.finish()
        return np.vstack([self.push(samples, y, breaks), self.finish()])

    def _push(self, samples: np.ndarray, y: np.ndarray) -> np.ndarray:
        late, count = self._tail.shape[1], len(samples)
        e = np.empty((_CARRIED + 1, late + count))
        e[:, :late] = self._tail
        np.subtract(samples.T[_TAKEN], y.T, out=e[:CONTROL, late:])
        e[CONTROL, late:] = self._law.step(samples) if self._law else np.nan
        e[_CARRIED, late:] = y[:, TORQUE]
        before = max(0, self._seen - self.half)
        self._seen += count
        out = np.zeros((max(0, self._seen - self.half) - before, len(BALANCES)))
        full = max(0, e.shape[1] - 2 * self.half)
        out[:len(out) - full] = np.nan
        if full:
            filtered = np.zeros((len(BALANCES), full))
            _filter(e, self._pairs, self._taps, filtered)
            self._count_from_mean(filtered[_TRANSMISSION], e[_CARRIED, self.half:][:full])
            out[len(out) - full:] = filtered.T
        out[:, self._silent] = np.nan
        self._tail = e[:, -2 * self.half:].copy()
        return out

    def _count_from_mean(self, balance: np.ndarray, torque: np.ndarray) -> None:
        """Take the weighted mean so far off a balance, shape (n,), in place."""
        weight = torque**2 if self._loose else np.ones(len(torque))
        weight = np.where(np.isfinite(balance) & np.isfinite(weight), weight, 0.0)
        weighted = np.where(weight > 0.0, weight * balance, 0.0)
        sums = np.cumsum(np.vstack([self._zero, np.column_stack([weighted, weight])]), axis=0)
        self._zero = sums[-1]
        mean = sums[1:, 0] / np.where(sums[1:, 1] > 0.0, sums[1:, 1], 1.0)
        balance -= np.clip(mean, -self._unsure, self._unsure)


def _of_one_sample(servo: Servo, taps: np.ndarray, noise: np.ndarray) -> float:
    """Return by how much one sample's noise sets the transmission off, in its noise floors."""
    off = taps[_TRANSMISSION, :CONTROL].sum(axis=1)
    each = [share * servo.noise(name) for share, name in zip(off, OUTPUTS, strict=True) if share]
    floor = float(noise[_TRANSMISSION])
    return float(np.linalg.norm(each)) / floor if floor > 0.0 else 0.0


def half_of(window: float, period: float) -> int:
    """Return half of a filter's length in samples; both arguments in s."""
    return max(3, round(window / period / 2.0))


def channel_residuals(samples: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return rig minus twin for the channels of recording.COMPARED, shape (n, 4)."""
    return samples.take([_TAKEN[c] for c in _COMPARED], axis=1) - y.take(_COMPARED, axis=1)


@njit(nogil=True, cache=True)
def _filter(e, pairs, taps, out):
    """Add the filtered rows of `e` to the balances; each answer is summed in the same order."""
    width, tile = taps.shape[1], 1024  # answers at once, so that they stay near the core
    for start in range(0, out.shape[1], tile):
        count = min(out.shape[1] - start, tile)
        for p in range(pairs.shape[0]):
            answer = out[pairs[p, 0], start:start + count]
            channel = e[pairs[p, 1], start:start + count + width - 1]
            for j in range(width):
                tap, shifted = taps[p, j], channel[j:j + count]
                for k in range(count):
                    answer[k] += tap * shifted[k]
