"""
Cases by seed: a machine, its servo file, its recordings, and what the servo file lacks.

Balanced over mechanisms, machines and severities, and mixed so that every beginning of a list is a
fair sample. What a case is stands at once; its recordings are made when they are asked for.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from . import (
    drive_faults,
    friction_faults,
    gear_faults,
    sensor_faults,
    torque_faults,
    unlisted_faults,
)
from .bench_run import Fault
from .fault_case import Case
from .fault_terms import Inapplicable, MECHANISMS
from .rig_machine import Machine, within_tolerance
from .rig_machines import MACHINES, STYLES, told
from .visibility import SEVERITIES

_ORDER = (drive_faults, gear_faults, sensor_faults, friction_faults, torque_faults)
"""The modules in an order that fixes which cases a seed gives."""

LISTED = tuple(name for module in _ORDER for name, one in MECHANISMS.items()
               if one.build.__module__ == module.__name__)
UNLISTED = tuple(name for name, one in MECHANISMS.items()
                 if one.build.__module__ == unlisted_faults.__name__)
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
