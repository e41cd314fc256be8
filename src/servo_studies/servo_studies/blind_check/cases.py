"""
The cases of the blind check, drawn from one seed: the same seed gives the same cases, always.

A case is what the emulated rig is told and what is true of it. The diagnosis never sees either.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any
import zlib

import numpy as np

from .case_kinds import KINDS
from .fault_tables import Fault, faults, Machine, machines, plans, severities, SPLITS

MULTIPLES = (0.5, 1.0, 2.0, 4.0)
WITHIN = 0.9  # share of a tolerance in which the values of a null case lie
NEAR = 0.25  # and those of other cases, so that they do not undo what is withheld
FACTOR = 1.25  # by which varied settings of an excitation differ at most
COMBINED = (2.0, 4.0)  # multiples in pairs and triples, and where a cause is removed or foreign


@dataclass(frozen=True)
class Truth:
    """One fault that the rig has: ``severity`` of its property, ``multiple`` of the smallest."""

    fault: str
    multiple: float
    severity: float


@dataclass(frozen=True)
class Case:
    """
    One case.

    ``set`` are properties of the rig by path; ``without`` what is taken out of the catalogue;
    ``recordings`` by split are orders to the rig.
    """

    name: str
    kind: str
    machine: str
    truths: tuple[Truth, ...]
    set: Mapping[str, float]
    without: tuple[str, ...]
    recordings: Mapping[str, tuple[Mapping[str, Any], ...]]

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The faults that the rig has."""
        return tuple(faults()[truth.fault] for truth in self.truths)

    @property
    def multiple(self) -> float:
        """The smallest multiple of a smallest detectable severity in it; 0 for a null case."""
        return min((truth.multiple for truth in self.truths), default=0.0)

    def as_json(self) -> dict[str, Any]:
        """Return it as plain mappings and lists."""
        return asdict(self)


def of_plan(plan: str) -> list[Case]:
    """
    Return the cases of a plan of plans.yaml, so ordered that every beginning of it is a fair mix.

    Raises KeyError for an unknown plan, RuntimeError without severities.
    """
    if plan not in plans():
        raise KeyError(f"there is no plan '{plan}'; there are {list(plans())}")
    if not severities():
        raise RuntimeError('severities.yaml is empty; `servo-identify blind-check --severities` '
                           'finds the smallest detectable ones')
    told = plans()[plan]
    groups = []
    for machine in told['machines']:
        for kind in KINDS:
            groups.append(list(_drawn(kind, machines()[machine], told)))
    return _mixed(groups)


def case(plan: str, name: str) -> Case:
    """Return one case of a plan; raises KeyError that names near ones."""
    known = {one.name: one for one in of_plan(plan)}
    if name in known:
        return known[name]
    near = [other for other in known if name.split('-')[-1] in other or other in name]
    raise KeyError(f"plan {plan} has no case '{name}'; there are {near[:12] or list(known)[:12]}")


def _mixed(groups: list[list[Case]]) -> list[Case]:
    """Spread each group evenly over the whole."""
    placed = [((i + 0.5) / len(group), g, one)
              for g, group in enumerate(groups) for i, one in enumerate(group)]
    return [one for _, _, one in sorted(placed, key=lambda entry: entry[:2])]


def _drawn(kind: str, machine: Machine, told: Mapping[str, Any]) -> Iterator[Case]:
    """Yield the cases of a kind that a plan asks for."""
    smallest = {fault: value for fault, value in severities()[machine.name].items()
                if fault in told.get('faults', (fault,))}
    count, seed = told['counts'].get(kind, 0), told['seed']
    for label, truths, without in _truths(kind, machine, count, seed, smallest):
        name = f'{machine.name}-{kind}-{label}'
        rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
        yield _case(name, kind, machine, truths, without, rng, told)


def _truths(kind: str, machine: Machine, count: int, seed: int, smallest: Mapping[str, float]
            ) -> Iterator[tuple[str, tuple[Truth, ...], tuple[str, ...]]]:
    rng = np.random.default_rng([seed, zlib.crc32(f'{machine.name} {kind}'.encode())])
    known = [t for t in smallest if faults()[t].known]
    foreign = [t for t in smallest if not faults()[t].known]

    def truth(fault: str, multiple: float) -> Truth:
        return Truth(fault, multiple, multiple * smallest[fault])

    if kind == 'null':
        for number in range(count):
            yield f'{number + 1:02d}', (), ()
    elif kind == 'single':
        order = [str(fault) for fault in rng.permutation(known)]
        for number in range(count):
            turn, at = divmod(number, len(order))
            multiple = MULTIPLES[(at + turn) % len(MULTIPLES)]
            yield f'{order[at]}-{multiple:g}x', (truth(order[at], multiple),), ()
    elif kind in ('removed', 'foreign'):
        pool = foreign if kind == 'foreign' else [t for t in known if faults()[t].removable]
        order = [str(fault) for fault in rng.permutation(pool)]
        for number in range(count if order else 0):
            turn, at = divmod(number, len(order))
            without = faults()[order[at]].remove if kind == 'removed' else ()
            multiple = COMBINED[(turn + at) % len(COMBINED)]
            yield f'{order[at]}-{turn + 1}', (truth(order[at], multiple),), without
    else:
        many = {'pair': 2, 'triple': 3}[kind]
        for number in range(count):
            chosen = _together(rng, known, many)
            truths = tuple(truth(fault, float(rng.choice(COMBINED))) for fault in chosen)
            yield f'{number + 1:02d}-{"+".join(chosen)}', truths, ()


def _together(rng: np.random.Generator, known: list[str], many: int) -> list[str]:
    """Draw faults whose names and properties do not meet."""
    chosen: list[str] = []
    for name in rng.permutation(known):
        one = faults()[name]
        if all(not one.accepted & faults()[other].accepted
               and not {one.property, *one.set} & {faults()[other].property, *faults()[other].set}
               for other in chosen):
            chosen.append(str(name))
        if len(chosen) == many:
            break
    return chosen


def _case(name: str, kind: str, machine: Machine, truths: tuple[Truth, ...],
          without: tuple[str, ...], rng: np.random.Generator, told: Mapping[str, Any]) -> Case:
    reach = WITHIN if kind == 'null' else NEAR
    values = dict(machine.set)
    for path in machine.tolerated:
        off = reach * machine.share(path) * rng.uniform(-1.0, 1.0)
        values[path] = machine.base(path) * (1.0 + off)
    for truth in truths:
        fault = faults()[truth.fault]
        values |= fault.settings(machine, truth.severity)
        values |= {path: rng.uniform(*span) for path, span in fault.vary.items()}
    values = {path: float(f'{value:.9g}') for path, value in values.items()}
    recordings = {split: tuple(
        order for order in _orders(machine, split, values, rng,
                                   told['replicates'] if split == 'screen' else 1)
        if order['family'] in told.get('families', (order['family'],))) for split in SPLITS}
    return Case(name, kind, machine.name, truths, values, without, recordings)


def _orders(machine: Machine, split: str, values: Mapping[str, float], rng: np.random.Generator,
            replicates: int) -> Iterator[dict[str, Any]]:
    for family, told in machine.recordings[split].items():
        settings = dict(told['settings'])
        for key in told['vary']:
            settings[key] = float(f'{settings[key] * FACTOR ** rng.uniform(-1.0, 1.0):.6g}')
        if family == 'multisine':
            settings['phases'] = int(rng.integers(1, 10**6))
        for replicate in range(1, replicates + 1):
            yield {'name': f'{split}-{family}-{replicate}', 'family': family,
                   'rig': str(machine.rig), 'settings': settings,
                   'duration': told['duration'], 'set': values,
                   'seed': int(rng.integers(1, 2**31)), 'replicate': replicate}
