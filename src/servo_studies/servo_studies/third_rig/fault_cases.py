"""
Cases by seed: a machine, its servo file, its recordings, and what the servo file lacks.

Balanced over mechanisms, machines and severities, and mixed so that every beginning of a list is a
fair sample. What a case is stands at once; its recordings are made when they are asked for.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from . import chain_faults, friction_faults, torque_faults, unlisted_faults  # noqa: F401
from .bench_run import Diverged, Fault, record
from .excitations import excite
from .fault_terms import Inapplicable, Mechanism, MECHANISMS
from .rig_machines import Machine, MACHINES, servo_file, STYLES, told, within_tolerance
from .visibility import Bench, MOST, SEVERITIES, unit_amount

LISTED = tuple(name for name, one in MECHANISMS.items() if not one.balance)
UNLISTED = tuple(name for name, one in MECHANISMS.items() if one.balance)
KINDS = {'one': len(LISTED), 'nothing lacks': 12, 'pair': 12, 'triple': 8, 'few sensors': 10,
         'unlisted': len(UNLISTED), 'own kind': 8, 'short': 6, 'slow': 6}
OWN_KIND = {'stribeck_friction': ('makkar', 'film', 'bo_pavelescu'),
            'transmission_error': ('runout', 'wave', 'teeth', 'pitch'),
            'cogging': ('edges', 'uneven'), 'gravity': ('parallelogram', 'balanced')}
# what a mechanism moves that the servo file tolerates within bounds, and in which direction
_EDGES = {'coulomb_friction': ('{}_coulomb', 1), 'viscous_friction': ('{}_viscous', 1),
          'torque_constant_error': ('torque_constant', -1), 'parameter:gain': ('gain', 0),
          'parameter:rotor_inertia': ('rotor_inertia', 0), 'backlash': ('gap', 1),
          'parameter:load_inertia': ('load_inertia', 0), 'stiffness_error': ('stiffness', 0)}
_UPWARD = {'film', 'picked_up'}   # curves of those with no direction of their own
_DOWNWARD = {'warming'}


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


class _Shares:
    """Takes what was taken least, by chance among equals."""

    def __init__(self, chance: np.random.Generator) -> None:
        self.chance, self.taken = chance, Counter()

    def least(self, choices: Any, key: str = '') -> Any:
        """Return the choice that was taken least so far. Raises Inapplicable if there is none."""
        choices = list(choices)
        if not choices:
            raise Inapplicable(f'nothing is left to choose for {key}')
        self.chance.shuffle(choices)
        choice = min(choices, key=lambda one: self.taken[key, one])
        self.taken[key, choice] += 1
        return choice


def cases(seed: int, first: int | None = None) -> list[Case]:
    """Return the cases of a seed, or the first of them."""
    chance = np.random.default_rng(seed)
    shares = _Shares(chance)
    order = [(k / count + chance.uniform(0, 0.3 / count), kind)
             for kind, count in KINDS.items() for k in range(count)]
    kinds = [kind for _, kind in sorted(order)]
    return [_case(f's{seed}_{i:03d}', kind, shares, chance)
            for i, kind in enumerate(kinds[:first])]


def _case(name: str, kind: str, shares: _Shares, chance: np.random.Generator) -> Case:
    """Return a case of a kind."""
    number = {'nothing lacks': 0, 'pair': 2, 'triple': 3}.get(kind, 1)
    wanted = UNLISTED if kind == 'unlisted' else tuple(OWN_KIND) if kind == 'own kind' else LISTED
    names = [shares.least([one for one in wanted], kind)] if number == 1 else []
    style = 'rich' if kind == 'own kind' else shares.least(STYLES, 'style')
    machines = [one for one in MACHINES if _possible(told(one, style), names, kind)]
    key = 'machine' if kind in ('one', 'pair', 'triple') else f'machine, {kind}'
    machine = told(shares.least(machines, key), style)
    while len(names) < number:
        names.append(shares.least([one for one in LISTED if one not in names and (
            MECHANISMS[one].needs <= machine.has) and _curves(one, machine, kind)], 'several'))
    faults = tuple(_fault(one, machine, kind, chance, shares) for one in names)
    true = within_tolerance(machine, chance)
    for one in faults:
        true = _at_edge(machine, true, one)
    if kind == 'few sensors':
        machine, true = _with_less(machine, true, faults, chance)
    severities = tuple(shares.least(SEVERITIES, 'severity') for _ in faults)
    families, seconds, replicates, tempo = machine.families, machine.seconds, 3, 1.0
    if kind == 'short':
        families, replicates = ('speed_ladder', 'load_steps', 'multisine'), 1
    elif kind == 'slow':
        families, tempo = ('speed_ladder', 'slow_reversals', 'load_steps', 'moves'), 0.2
        seconds, replicates = min(60.0, 4 * seconds), 2
    return Case(f'{name}_{machine.name}_{kind.replace(" ", "_")}', kind, style, true,
                machine, faults, severities, families, replicates, seconds, tempo,
                int(chance.integers(2**31)))


def _possible(machine: Machine, names: list[str], kind: str) -> bool:
    """Return whether a case of a kind with these mechanisms can be made of a machine."""
    if kind == 'few sensors' and len(machine.noise) < 2:
        return False
    known = {one.effect for one in machine.known}
    return all(MECHANISMS[one].needs <= machine.has and _curves(one, machine, kind)
               and (kind != 'own kind' or one in known) for one in names)


def _curves(name: str, machine: Machine, kind: str) -> list[tuple[str, str]]:
    """Return the curves and sites of a mechanism that a machine can have."""
    found = []
    for site in MECHANISMS[name].sites:
        for curve in OWN_KIND[name] if kind == 'own kind' else MECHANISMS[name].curves:
            try:
                MECHANISMS[name].build(0.01, machine.scale(site), np.random.default_rng(0), curve)
            except Inapplicable:
                continue
            if site not in ('load_position', 'torque', 'current') or site in machine.noise:
                found.append((curve, site))
    return found


def _fault(name: str, machine: Machine, kind: str, chance: np.random.Generator, shares: _Shares
           ) -> Fault:
    """Return a fault of a mechanism, with the curve and site that were taken least."""
    curve, site = shares.least(_curves(name, machine, kind), name)
    return Fault(name, site, curve, int(chance.integers(2**31)), float(chance.choice([-1, 1])))


def _at_edge(machine: Machine, true: Machine, fault: Fault) -> Machine:
    """Put what a fault moves to the edge of its tolerance, from which severity then counts."""
    if fault.mechanism not in _EDGES or fault.curve == 'crank':
        return true
    field, way = _EDGES[fault.mechanism]
    way = way or (1 if fault.curve in _UPWARD else -1 if fault.curve in _DOWNWARD else fault.way)
    names = [field.format(fault.site)]
    if machine.rigid and names[0] != 'gain':  # one shaft's value would hide the other's
        names += {'motor_coulomb': ['load_coulomb'], 'load_coulomb': ['motor_coulomb'],
                  'motor_viscous': ['load_viscous'], 'load_viscous': ['motor_viscous'],
                  'rotor_inertia': ['load_inertia'], 'load_inertia': ['rotor_inertia'],
                  }.get(names[0], [])
    shares = machine.tolerance | {'gap': sum(
        one.tolerance['width'] for one in machine.known if one.effect == 'backlash')}
    return replace(true, plant=true.plant._replace(**{
        one: getattr(machine.plant, one) * (1 + 0.95 * way * shares.get(one, 0.0))
        for one in names}))


def _with_less(machine: Machine, true: Machine, faults: tuple[Fault, ...],
               chance: np.random.Generator) -> tuple[Machine, Machine]:
    """Return a machine as told and as it is without one or two of its sensors."""
    spare = [one for one in machine.noise if one != 'motor_position' and one != 'temperature'
             and not (one == 'load_position' and machine.name == 'antenna')]
    chance.shuffle(spare)
    kept = dict(machine.noise)
    for one in spare[:chance.integers(1, 3)]:
        less = replace(machine, noise={k: v for k, v in kept.items() if k != one})
        if all(MECHANISMS[f.mechanism].needs <= less.has and f.site != one for f in faults):
            kept = less.noise
    return replace(machine, noise=kept), replace(true, noise=kept)
