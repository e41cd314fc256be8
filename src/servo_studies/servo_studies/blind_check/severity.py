r"""
The smallest severity at which a fault shows, found on the rig alone: no twin, no diagnosis.

The rig is run twice with the same commands and without noise, with and without the fault. Of each
recording family five signals are compared, as means over 10 ms: command, current, torque, torsion
and motor speed. From the difference that is taken which the tolerances of the servo file could
make up for: the rig's own differences for each tolerated value, bounded by its tolerance (and a
constant torsion, since the zeros of two encoders are never the same). What is left of a signal
counts in units of

.. math:: \max(3\,\text{noise floor},\ 5\,\%\ \text{of the signal's own rms})

and the smallest severity is the one at which the largest of them, as rms over a family, is 1. The
noise floor is the rms of the same signal's difference between the rig with and without its noise.
Where a fault is an error of a tolerated value, the smallest severity is at least one and a half
times the tolerance: below it nothing need be missing. The same of what any recording leaves open:
a row has one time for all its channels, and does not say when in the sample each was read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from math import exp, log
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear
import yaml

from .fault_tables import Fault, faults, Machine, machines
from .rig_recordings import Rig

FLOORS = 3.0  # noise floors that count as one
SHARE = 0.05  # of a signal's rms that counts as one
BLOCK = 10  # samples of 1 ms
CLOSE = 0.08  # relative error of a severity
TRIES = 9
BEYOND = 1.5  # tolerances by which a tolerated value must be off
SIGNALS = ('command', 'current', 'torque', 'wind_up', 'speed')
_QUIET = {'sensors.noise': 0.0, 'sensors.counts': 0.0}


class Workbench:
    """One machine with its base recordings; answers how strongly a change of the rig shows."""

    def __init__(self, machine: Machine, rig: Rig, folder: Path) -> None:
        self.machine = machine
        self.rig = rig
        self.folder = folder
        self.runs = 0

    def run(self, values: Mapping[str, float]) -> np.ndarray:
        """Return the signals of all families, shape (signals, families, blocks); NaN pads."""
        self.runs += 1
        place = self.folder / f'run{self.runs}'
        base = {path: self.machine.base(path) for path in self.machine.tolerated}
        told = self.machine.recordings['screen']
        self.rig.record([
            {'family': family, 'rig': str(self.machine.rig_path), 'seed': 1,
             'settings': row['settings'], 'duration': row['duration'],
             'set': {**self.machine.set, **base, **values},
             'output': str(place / f'{family}.npz')} for family, row in told.items()], place)
        longest = int(max(row['duration'] for row in told.values()) * 1000) // BLOCK
        out = np.full((len(SIGNALS), len(told), longest), np.nan)
        for number, family in enumerate(told):
            signals = self._signals(place / f'{family}.npz')
            out[:, number, :signals.shape[1]] = signals
            (place / f'{family}.npz').unlink()
        return out

    def _signals(self, path: Path) -> np.ndarray:
        with np.load(path) as table:
            motor = table['motor_position']
            wind_up = motor / self.machine_ratio - table['load_position']
            means = [table['voltage'], table['current'], table['torque'], wind_up]
            rows = len(motor) // BLOCK
            blocks = [one[:rows * BLOCK].reshape(rows, BLOCK).mean(axis=1) for one in means]
            blocks.append(np.gradient(motor[:rows * BLOCK].reshape(rows, BLOCK).mean(axis=1)))
        return np.array(blocks)

    @cached_property
    def machine_ratio(self) -> float:
        """Turns of the motor for one of the load."""
        from servo_twin.description import servo_file
        return servo_file.load(self.machine.servo_path).values['mechanism.ratio']

    @cached_property
    def quiet(self) -> np.ndarray:
        """Signals of the plain rig without noise."""
        return self.run(_QUIET)

    @cached_property
    def unit(self) -> np.ndarray:
        """What counts as one, by signal and family."""
        floor = _rms(self.run({}) - self.quiet)
        centred = self.quiet - np.nanmean(self.quiet, axis=2, keepdims=True)
        return np.maximum(FLOORS * floor, SHARE * _rms(centred))[:, :, None]

    @cached_property
    def tolerances(self) -> np.ndarray:
        """What each tolerance can move, in units: columns, the last one a constant torsion."""
        columns = []
        for path in self.machine.tolerated:
            step = 0.5 * self.machine.share(path)
            moved = self.run({**_QUIET, path: self.machine.base(path) * (1.0 + step)})
            columns.append(((moved - self.quiet) / self.unit).ravel() / 0.5)
        zero = np.zeros_like(self.quiet)
        zero[SIGNALS.index('wind_up')] = 1.0
        columns.append((zero / self.unit).ravel())
        return np.array(columns).T

    def shows(self, values: Mapping[str, float]) -> tuple[float, str]:
        """Return how strongly properties of the rig show, in units, and in which signal."""
        change = (self.run({**_QUIET, **values}) - self.quiet) / self.unit
        flat = change.ravel()
        good = np.isfinite(flat) & np.isfinite(self.tolerances).all(axis=1)
        table = self.tolerances[good]
        bound = np.ones(table.shape[1])
        bound[-1] = np.inf
        q, r = np.linalg.qr(table)
        fitted = lsq_linear(r + 1e-12 * np.eye(len(r)), q.T @ flat[good], (-bound, bound))
        left = np.full(len(flat), np.nan)
        left[good] = flat[good] - table @ fitted.x
        strength = np.nan_to_num(_rms(left.reshape(change.shape)))
        at = np.unravel_index(np.argmax(strength), strength.shape)
        families = list(self.machine.recordings['screen'])
        return float(strength[at]), f'{SIGNALS[at[0]]} of {families[at[1]]}'


def smallest(shows: Callable[[float], tuple[float, str]], start: float
             ) -> tuple[float | None, str, int]:
    """
    Find the severity at which ``shows`` gives 1: its value, where it shows, and the tries taken.

    By secants between logarithms, halved where they leave their bracket. None where it never
    shows up to a thousand times ``start``.
    """
    low = high = None
    severity, where = start, ''
    for attempt in range(1, TRIES + 1):
        strength, where = shows(severity)
        point = (log(severity), log(max(strength, 1e-9)))
        if abs(point[1]) < CLOSE:
            return severity, where, attempt
        low, high = (point, high) if point[1] < 0.0 else (low, point)
        if low is None or high is None:
            step = min(max(abs(point[1]), 0.3), 2.0)
            severity = exp(point[0] + (step if point[1] < 0.0 else -step))
            if severity > 1e3 * start:
                return None, where, attempt
        else:
            slope = (high[1] - low[1]) / (high[0] - low[0])
            guess = low[0] - low[1] / slope
            edge = 0.1 * (high[0] - low[0])
            severity = exp(min(max(guess, low[0] + edge), high[0] - edge))
    return (exp(high[0]), where, TRIES) if high else (None, where, TRIES)


def search(machine: Machine, names: list[str], told: Callable[[str], None]) -> dict[str, Any]:
    """Find the smallest detectable severities of faults on a machine: rows of severities.yaml."""
    found = {}
    with TemporaryDirectory() as folder, Rig() as rig:
        bench = Workbench(machine, rig, Path(folder))
        for name in names:
            fault = faults()[name]
            value, where, tries = smallest(
                lambda s, fault=fault: bench.shows(_settings(fault, machine, s)),
                fault.start[machine.name])
            value = value and max(value, beyond(machine, fault))
            found[name] = {'severity': value and float(f'{value:.3g}'), 'shows_in': where,
                           'tries': tries}
            told(f'{machine.name} {name}: {found[name]}')
    return found


def beyond(machine: Machine, fault: Fault) -> float:
    """Return the severity below which what a fault does is within what is taken for granted."""
    if fault.granted:
        return BEYOND * fault.granted
    if fault.tolerance_of not in machine.tolerated:
        return 0.0
    share = BEYOND * machine.share(fault.tolerance_of)
    return share if fault.share else share * machine.base(fault.tolerance_of)


def write(path: Path, told: Callable[[str], None], only: list[str] | None = None) -> None:
    """Find all severities, or those of some faults, and write them beside what is known."""
    known = (yaml.safe_load(path.read_text()) if path.is_file() else None) or {}
    for machine in machines().values():
        rows = known.setdefault(machine.name, {})
        names = [t.name for t in faults().values() if machine.name in t.start
                 and (t.name in only if only else t.name not in rows)]
        rows |= search(machine, names, told)
        path.write_text(_HEADER + yaml.safe_dump(known, sort_keys=True))


_HEADER = """\
# Smallest detectable severity of each fault on each machine, as severity.py defines it; null:
# none was found. Written by `servo-identify blind-check --severities`.
"""


def _settings(fault: Fault, machine: Machine, severity: float) -> dict[str, float]:
    middle = {path: 0.5 * (low + high) for path, (low, high) in fault.vary.items()}
    return {**middle, **fault.settings(machine, severity)}


def _rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.nanmean(values**2, axis=2))
