"""How a twin is doing: what came in and went out, how late, and where the rig departs from it."""

from __future__ import annotations

from math import inf

import numpy as np

from ..lockstep.lockstep import Lockstep
from ..lockstep.twin import Twin
from ..recording.joined_samples import CHANNELS
from ..recording.recording import BALANCES, COMPARED
from ..recording.waiting_blocks import JOINS_FROM, WaitingBlocks

OK, WARN, ERROR, STALE = 0, 1, 2, 3
HOLDS = 3
LIVE = 1.0  # s: an answer so soon after its samples means stamps of our own clock
PRACTICAL = 3.0
"""A balance stands out when its RMS over a report is more than this many noise floors."""


class TwinHealth:
    """
    Counts over the life of a twin, and figures from one report to the next.

    Latencies are in s from the instant of a block's last sample to when its answer was published;
    residuals answer half a filter window late by design. How far a twin is behind is told by the
    samples that wait and, where their stamps are of our own clock, by the latency: what has not
    come to the twin yet waits too.

    A level is raised at once and falls when HOLDS reports in a row had a lower one, so that a rig
    on the edge of a limit does not blink.
    """

    def __init__(self) -> None:
        self.samples_in = self.samples_out = self.malformed = 0
        self.why = ''
        self.loaded = 0
        self._lag = self._late = 0.0
        self._fastest = inf
        self._held = (OK, '')
        self._better = 0
        self._latencies: dict[str, list[float]] = {'prediction': [], 'residual': []}
        self._compared: list[np.ndarray] = []
        self._known = np.zeros(len(CHANNELS), dtype=bool)
        self._before: dict[str, int] = {}

    def predicted(self, samples: np.ndarray, latency: float) -> None:
        """Note that a prediction was published of samples, shape (n, len(CHANNELS))."""
        self.samples_in += len(samples)
        self._known |= np.isfinite(samples).any(axis=0)
        self._fastest = min(self._fastest, latency)
        if self._fastest < LIVE:
            self._late = max(self._late, latency)
        self._latencies['prediction'].append(latency)

    def compared(self, values: np.ndarray, latency: float) -> None:
        """Note that a residual was published, shape (n, len(COMPARED) + len(BALANCES))."""
        self.samples_out += len(values)
        self._latencies['residual'].append(latency)
        self._compared.append(values)

    def _unknown(self, twin: Twin | None) -> list[str]:
        """Return what was not known in any sample since the last report, and begin the next."""
        known, self._known = self._known, np.zeros(len(CHANNELS), dtype=bool)
        if twin is None:
            return []
        wanted = {sensor.channel for sensor in twin.servo.sensors} | {'voltage'}
        if twin.mode == 'closed_loop':
            wanted -= {'voltage'}
        return [name for name in CHANNELS if name in wanted and not known[CHANNELS.index(name)]]

    def _levels(self) -> np.ndarray:
        """Return the RMS of each balance since the last report, in noise floors; NaN: unknown."""
        if not self._compared:
            return np.full(len(BALANCES), np.nan)
        rows = np.vstack(self._compared)[:, len(COMPARED):]
        self._compared.clear()
        good = np.isfinite(rows)
        with np.errstate(invalid='ignore'):
            return np.sqrt(np.square(np.where(good, rows, 0.0)).sum(axis=0) / good.sum(axis=0))

    def report(self, lockstep: Lockstep | None, given_up: int, silent: tuple[str, ...],
               waiting: WaitingBlocks, mixed: str = '') -> tuple[int, str, dict[str, str]]:
        """
        Return (level, sentence, facts) since the last report, and begin the next one.

        ``mixed``: which topics several nodes publish, in words.
        """
        twin = lockstep.twin if lockstep else None
        counts = {
            'samples in': self.samples_in, 'samples out': self.samples_out,
            'bridged': twin.bridged if twin else 0, 'restarts': twin.restarts if twin else 0,
            'blocks given up': given_up, 'blocks malformed': self.malformed,
            'servos loaded': self.loaded, 'left out, overload': waiting.left_out,
            'blocks joined to catch up': waiting.joined,
            'angles left out': lockstep.screen.left_out if lockstep else 0,
        }
        self._lag = max(waiting.worst, self._late)
        behind, waiting.worst, self._late = waiting.worst, 0.0, 0.0
        new = {key: number - self._before.get(key, 0) for key, number in counts.items()}
        self._before = counts
        facts = {key: str(number) for key, number in counts.items()}
        period = twin.period if twin else 0.0
        facts['samples behind, at worst'] = str(round(behind / period) if period else 0)
        facts['seconds behind, at worst'] = f'{self._lag:.3f}'
        for kind, latencies in self._latencies.items():
            if latencies:
                middle, late = np.percentile(latencies, (50, 99)) * 1e3
                facts[f'latency of {kind}, ms'] = f'median {middle:.2f}, 99 % {late:.2f}'
            latencies.clear()
        compared = bool(self._compared)
        levels = self._levels()
        unknown = self._unknown(twin)
        if unknown:
            facts['not known'] = ', '.join(unknown)
        over = [name for name, level in zip(BALANCES, levels, strict=True) if level > PRACTICAL]
        for name, level in zip(BALANCES, levels, strict=True):
            if np.isfinite(level):
                facts[f'{name}, noise floors'] = f'{level:.2f}'
        if twin and twin.why:
            facts['last restart'] = twin.why
        nothing = compared and not np.isfinite(levels).any()
        level, said = self._sentence(new, twin, over, silent, unknown, nothing)
        if mixed:
            level, said = max(level, WARN), f'{mixed}; {said}'
        return *self._steady(level, said), facts

    def _steady(self, level: int, said: str) -> tuple[int, str]:
        """Return the level and sentence to tell: the last worse ones for a while."""
        self._better = self._better + 1 if level < self._held[0] else 0
        if 0 < self._better < HOLDS:
            return self._held[0], f'{said}; shortly before: {self._held[1]}'
        self._held, self._better = (level, said), 0
        return level, said

    def _sentence(self, new: dict[str, int], twin: Twin | None, over: list[str],
                  silent: tuple[str, ...], unknown: list[str], nothing: bool) -> tuple[int, str]:
        """Say the worst first; ``nothing``: no balance was known."""
        if silent:
            return STALE, f'waiting for {", ".join(silent)}'
        if not new['samples in']:
            return STALE, 'no samples since the last report'
        said = []
        if 'voltage' in unknown:
            said.append('no command is known (voltage): the twin runs on the last one, or on none')
        if nothing:
            said.append('nothing can be compared')
        if unknown:
            said.append(f'not known: {", ".join(unknown)}')
        if new['left out, overload'] > 0:
            said.append(f'too slow for the rig: {self._lag:.1f} s behind, began again at the '
                        f'newest sample, {new["left out, overload"]} left out')
        elif self._lag > JOINS_FROM:
            said.append(f'behind the rig by {self._lag:.2f} s at worst'
                        + (', catching up by larger blocks'
                           if new['blocks joined to catch up'] > 0 else ''))
        if new['restarts'] > 0:
            said.append(f'began again {new["restarts"]} times: {twin.why}')
        if new['bridged'] > 0:
            said.append(f'bridged {new["bridged"]} missing samples')
        if new['angles left out'] > 0:
            said.append(f'left out {new["angles left out"]} angles that no shaft can have: look '
                        'at the encoder, its supply and its cable')
        if new['blocks given up'] > 0:
            said.append(f'{new["blocks given up"]} blocks lost a part')
        if new['blocks malformed'] > 0:
            said.append(f'{new["blocks malformed"]} blocks malformed: {self.why}')
        level = WARN if said else OK
        if over:
            said.append(f'beyond the noise floor: {", ".join(over)}')
        return level, '; '.join(said) or 'the rig does what the twin says'
