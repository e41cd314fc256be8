"""One recording of one machine with its faults, as a logger writes it: columns by name, in SI."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .excitations import Excitation
from .fault_terms import Change, laws_of, MECHANISMS, memory_of
from .integrator import run
from .rig_machine import known_effects, Machine

SETTLING = 0.05   # of a recording, before it begins


class Diverged(RuntimeError):
    """A machine with its faults runs away."""


@dataclass(frozen=True)
class Fault:
    """
    A mechanism at a site, with one of its curves, and whether it is more (1) or less (-1).

    ``seed`` fixes what else is left open: phases, orders, widths.
    """

    mechanism: str
    site: str
    curve: str
    seed: int = 0
    way: float = 1.0

    def change(self, machine: Machine, amount: float) -> Change:
        """Return what it does to a machine at an amount. Raises Inapplicable."""
        scale, chance = machine.scale(self.site, self.way), np.random.default_rng(self.seed)
        return MECHANISMS[self.mechanism].build(amount, scale, chance, self.curve)


def with_faults(machine: Machine, faults: Sequence[tuple[Fault, float]]
                ) -> tuple[Machine, Change]:
    """Return a machine whose properties the faults changed, and what else they do."""
    whole = known_effects(machine)
    for fault, amount in faults:
        change = fault.change(machine, amount)
        machine = replace(machine, plant=machine.plant._replace(**change.plant))
        whole += change
    return machine, whole


def record(machine: Machine, excitation: Excitation, faults: Sequence[tuple[Fault, float]] = (),
           seed: int | None = 0) -> dict[str, np.ndarray]:
    """
    Return the columns of a recording; without a seed it has no noise, no counts and no jitter.

    The machine stands in its loop before the recording begins. Raises Diverged.
    """
    told, change = with_faults(machine, faults)
    plant, period = told.plant, machine.period
    samples = len(excitation.position)
    before = round(SETTLING * samples)
    inputs = np.column_stack([np.concatenate((np.full(before, column[0]), column))
                              for column in excitation])
    inputs[:before, 1] = 0.0
    closed = np.isnan(excitation.command[0])
    inputs[:before, 3] = np.nan if closed else 0.0
    whole = len(inputs)
    jitter, noise = np.zeros(whole), np.zeros((whole, 4))
    if seed is None:
        plant = plant._replace(motor_count=0.0, load_count=0.0, torque_count=0.0,
                               current_count=0.0)
    else:
        chance = np.random.default_rng(seed)
        jitter = machine.jitter * chance.standard_normal(whole)
        size = [machine.noise.get(one, 0.0) for one in CHANNELS]
        noise = size * chance.standard_normal((whole, 4))
    delay = change.delay(np.arange(whole)) if change.delay else np.zeros(whole)
    out = run(plant.as_record(), laws_of(change.terms), memory_of(change.memory), inputs, delay,
              jitter, noise, float(excitation.position[0]), -before * period, period,
              int(np.ceil(period / machine.step)))[before:]
    if not np.all(np.isfinite(out)) or np.ptp(np.diff(out[:, 0])) > (
            40 * period * machine.speed * plant.ratio):
        raise Diverged(f'{machine.name} runs away with {[fault for fault, _ in faults]}')
    columns = {'t': np.arange(samples) * period, 'voltage': out[:, 4]}
    for i, name in enumerate(CHANNELS):
        if name in machine.noise:
            columns[name] = out[:, i]
    columns['external_torque'] = excitation.external
    open_loop = np.full(samples, np.nan)
    columns['reference_position'] = excitation.position if closed and plant.kp else open_loop
    columns['reference_velocity'] = excitation.velocity if closed else open_loop
    if 'temperature' in machine.noise:
        scatter = 0.0 if seed is None else machine.noise['temperature'] * np.random.default_rng(
            seed + 1).standard_normal(samples)
        columns['temperature'] = 24.0 + out[:, 5] + scatter
    return columns


CHANNELS = ('motor_position', 'load_position', 'torque', 'current')
