"""
How much a fault changes what is measured, and the amount at which that is severity one.

A fault **shows** by the rms change of speed, twist, torque, current or command, as a multiple of
what hides it: what noise, counts and jitter make of that signal in the closed loop, and `MARGIN`
of its rms. Of each recording the clearest signal counts, of all recordings the rms. Severity 1 is
an amount that shows `SMALL` times; a severity is a multiple of that amount.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .bench_run import Diverged, Fault, record
from .excitations import Excitation
from .rig_machine import Machine

MARGIN, SMALL, SEVERITIES = 0.005, 3.0, (1.0, 2.0, 4.0, 8.0, 16.0)
MOST = 100.0  # that faults of a case together may show: half of the signal
_SPAN = 0.01  # s, over which a speed is taken


def signals(machine: Machine, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return what can be compared of a recording."""
    found = {name: columns[name] for name in ('torque', 'current') if name in columns}
    if np.any(np.isfinite(columns['reference_velocity'])):
        found['voltage'] = columns['voltage']
    ratio, span = machine.plant.ratio, max(1, round(_SPAN / machine.period / 2))
    motor = columns['motor_position'] / ratio
    found['speed'] = (motor[2 * span:] - motor[:-2 * span]) / (2 * span * machine.period)
    if 'load_position' in columns:
        found['twist'] = motor - columns['load_position']
    return found


class Bench:
    """The recordings of a machine without faults, and what hides a change of them."""

    def __init__(self, machine: Machine, excitations: Sequence[Excitation]) -> None:
        self.machine, self.excitations = machine, excitations
        self.plain = [signals(machine, record(machine, one, (), None)) for one in excitations]
        self.hides = []
        for one, plain in zip(excitations, self.plain, strict=True):
            noisy = signals(machine, record(machine, one, (), 1))
            self.hides.append({name: np.sqrt(np.mean((noisy[name] - clean)**2)
                                             + MARGIN**2 * np.mean(clean**2))
                               for name, clean in plain.items()})

    def shows(self, faults: Sequence[tuple[Fault, float]]) -> float:
        """Return how clearly faults show. Raises Diverged and Inapplicable."""
        scores = []
        for one, plain, hides in zip(self.excitations, self.plain, self.hides, strict=True):
            changed = signals(self.machine, record(self.machine, one, faults, None))
            scores.append(max(np.sqrt(np.mean((changed[name] - clean)**2)) / hides[name]
                              for name, clean in plain.items()))
        return float(np.sqrt(np.mean(np.square(scores))))


def unit_amount(bench: Bench, fault: Fault) -> float:
    """
    Return the amount of a fault that is severity one, within a fifth.

    Of a fault that cannot show that much on a machine it is the amount, of those tried, that comes
    closest. Raises Inapplicable where the machine does not have what the fault is about.
    """
    low, high, amount, best = 0.0, np.inf, 0.03, (np.inf, 0.03)
    for _ in range(14):
        try:
            seen = bench.shows([(fault, amount)])
        except Diverged:
            seen = np.inf
        if 0.8 * SMALL <= seen <= 1.2 * SMALL:
            return amount
        best = min(best, (abs(np.log(max(seen, 1e-9) / SMALL)), amount))
        low, high = (amount, high) if seen < SMALL else (low, amount)
        if low > 1e3:
            break
        guess = amount * np.clip(SMALL / max(seen, 1e-9), 0.05, 20.0)
        if not low < guess < high or not np.isfinite(seen):
            guess = np.sqrt(max(low, 1e-3 * high) * min(high, 1e3 * max(low, 1e-9)))
        amount = float(guess)
    return best[1]
