"""One case: a machine, what its servo file says, what it lacks, and its recordings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .bench_run import Diverged, Fault, record
from .excitations import excite
from .fault_terms import Mechanism, MECHANISMS
from .rig_machine import Machine
from .servo_yaml import servo_file
from .visibility import Bench, MOST, unit_amount


@dataclass(frozen=True)
class Recording:
    """One table of a case: its columns by import name, in SI units."""

    name: str
    family: str
    replicate: int
    period: float
    columns: dict[str, np.ndarray]


@dataclass(frozen=True)
class Lack:
    """What a servo file lacks: a fault, its severity, and the amount that is severity one."""

    fault: Fault
    severity: float
    unit: float

    @property
    def amount(self) -> float:
        """The amount of the fault."""
        return self.unit * self.severity

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of the fault."""
        return MECHANISMS[self.fault.mechanism]

    def as_tree(self) -> dict[str, Any]:
        """Return all that is known of it, for a file."""
        one, fault = self.mechanism, self.fault
        return {'effect': None if one.balance else one.name, 'mechanism': one.name,
                'site': fault.site, 'curve': fault.curve, 'law': one.curves[fault.curve],
                'way': fault.way, 'seed': fault.seed, 'severity': self.severity,
                'amount': self.amount, 'place': one.balance or None,
                'variables': list(one.variables)}


@dataclass(frozen=True)
class Case:
    """A case; ``machine`` is as it is, ``told`` as its servo file says."""

    name: str
    kind: str
    style: str
    machine: Machine
    told: Machine
    faults: tuple[Fault, ...]
    severities: tuple[float, ...]
    families: tuple[str, ...]
    replicates: int
    seconds: float
    tempo: float                 # share of the speeds and accelerations that the machine can do
    seed: int

    @cached_property
    def servo(self) -> str:
        """The text of the servo file."""
        return servo_file(self.told)

    @property
    def truth(self) -> list[tuple[str, str]]:
        """What a diagnosis should name: (effect, site); nothing of what no catalogue has."""
        return [(one.mechanism, one.site) for one in self.faults
                if not MECHANISMS[one.mechanism].balance]

    @property
    def severity(self) -> float:
        """The greatest severity, 0 where nothing lacks."""
        return max((one.severity for one in self.lacks), default=0.0)

    @cached_property
    def lacks(self) -> list[Lack]:
        """What the servo file lacks; severities are halved until the loop copes with them."""
        units = [unit_amount(self._bench, fault) for fault in self.faults]
        lacks = [self._tamed([Lack(*one)])[0] for one in zip(
            self.faults, self.severities, units, strict=True)]
        return self._tamed(lacks)

    def _tamed(self, lacks: list[Lack]) -> list[Lack]:
        """Return lacks with all severities halved until they show no more than they may."""
        while True:
            try:
                if self.shows(lacks) <= MOST:
                    return lacks
            except Diverged:
                pass
            if max(one.severity for one in lacks) < 0.1:
                raise Diverged(f'{self.name}: its loop copes with no severity')
            lacks = [replace(one, severity=one.severity / 2) for one in lacks]

    @cached_property
    def recordings(self) -> list[Recording]:
        """The recordings: each family as often as there are replicates, other each time."""
        faults = [(one.fault, one.amount) for one in self.lacks]
        return [Recording(f'{family}_{k + 1}', family, k + 1, self.machine.period, record(
                    self.machine, self._excitation(i, k), faults, self.seed + 100 * i + k))
                for i, family in enumerate(self.families) for k in range(self.replicates)]

    def shows(self, lacks: list[Lack] | None = None) -> float:
        """Return how clearly faults, else all of them, show together, see `visibility`."""
        lacks = self.lacks if lacks is None else lacks
        return self._bench.shows([(one.fault, one.amount) for one in lacks]) if lacks else 0.0

    @cached_property
    def _bench(self) -> Bench:
        return Bench(self.machine, [self._excitation(i, 0) for i in range(len(self.families))])

    def _excitation(self, family: int, replicate: int):
        slow = replace(self.machine, speed=self.machine.speed * self.tempo,
                       acceleration=self.machine.acceleration * self.tempo)
        return excite(slow, self.families[family], self.seconds, np.random.default_rng(
            [self.seed, family, replicate]))
