"""
Whether what a diagnosis proposes tells an ambiguous pair apart.

The rig makes the proposed recording twice, and once more a recording drawn at random from the
families of the machine; the diagnosis is asked again with each of them beside the first ones.
An ambiguous pair for which no recording is proposed counts as not resolved by one; where a value
is to be measured instead, the rig's own is held against what either cause would make it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import json
from pathlib import Path
from typing import Any
import zlib

import numpy as np

from .case_outcome import judged
from .cases import Case
from .fault_tables import Machine, machines
from .rig_recordings import make_bags

REPLICATES = 2
_RENAMED = {'chirp': {'from': 'first', 'to': 'last'},
            'multisine': {'from': 'first', 'to': 'last'},
            'slow_reversals': {'speed': 'amplitude'}}


def open_pair(case: Case, place: Path) -> list[str]:
    """
    Return the pair that the answer to a case left open and no recording was asked for yet.

    Empty where there is no answer, it is sure, or neither of the two is a truth of the case.
    """
    report = place / 'diagnosis' / 'report.json'
    if (place / 'resolved.json').is_file() or not report.is_file():
        return []
    proposed = json.loads(report.read_text()).get('next_experiment') or {}
    pair = proposed.get('separates') or []
    return pair if len(pair) == 2 and _about_a_truth(case, pair) else []


def resolve(case: Case, bags: Mapping[str, Sequence[Path]], place: Path,
            ask: Callable[[Mapping[str, Sequence[Path]], Path], Mapping[str, Any] | None]) -> None:
    """
    Follow the proposal in the report of a case with an `open_pair` and write resolved.json.

    ``ask(bags, folder)`` diagnoses and returns the report, None where it failed.
    """
    report = json.loads((place / 'diagnosis' / 'report.json').read_text())
    proposed = report['next_experiment']
    pair = proposed['separates']
    machine = machines()[case.machine]
    answers = {'separates': pair, 'proposed': proposed['family']}
    rng = np.random.default_rng(zlib.crc32(case.name.encode()))
    family = str(rng.choice(list(machine.recordings['report'])))
    told = machine.recordings['report'][family]
    answers['random'] = family
    for name, order in (
            ('proposed', as_order(machine, proposed['family'], proposed.get('settings', {}))),
            ('random', {'family': family, 'settings': told['settings'],
                        'duration': told['duration']})):
        seeds = [int(rng.integers(1, 2**31)) for _ in range(REPLICATES)]
        if not order['family']:  # nothing of the menu separates them: that resolves nothing
            answers[f'by_{name}'] = False
            continue
        more = make_bags(
            [{**order, 'name': f'{name}-{number + 1}', 'rig': str(machine.rig_path),
              'set': case.set, 'seed': seed, 'replicate': number + 1}
             for number, seed in enumerate(seeds)], machine.servo_path, place)
        again = ask({**bags, 'screen': [*bags['screen'], *more]}, place / name)
        answers[f'by_{name}'] = bool(again) and _resolved(case, again, pair)
    answers['by_value'] = _told_by_value(case, proposed.get('measure'))
    (place / 'resolved.json').write_text(json.dumps(answers, indent=1) + '\n')


def _told_by_value(case: Case, proposed: Mapping[str, Any] | None) -> bool:
    """Whether the value of the rig is nearest to what a truth of the case would make it."""
    of_rig = {twin: path for path, twins in machines()[case.machine].tolerated.items()
              for twin in twins}
    if not proposed or proposed['parameter'] not in of_rig:
        return False
    path, values = of_rig[proposed['parameter']], proposed['values']
    actual = case.set[path]
    for truth, fault in zip(case.truths, case.faults, strict=True):
        if fault.share and fault.tolerance_of == path != fault.property:  # withheld beside it
            actual *= 1.0 + truth.severity
    nearest = min(values, key=lambda name: abs(values[name] - actual))
    return any(nearest in fault.accepted for fault in case.faults)


def as_order(machine: Machine, family: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Put a proposal into the settings that the families of the rig have."""
    settings = dict(settings)
    duration = float(settings.pop('duration', 10.0))
    given = {_RENAMED.get(family, {}).get(k, k): v for k, v in settings.items()}
    if 'speeds' in given:
        speeds = given.pop('speeds')
        given |= {'lowest': min(speeds), 'highest': max(speeds), 'steps': len(speeds),
                  'dwell': 0.5 * duration / len(speeds)}
    if family == 'turns':
        given['angle'] = max(0.5 * duration - 0.5, 0.5) * given['speed']
    if family == 'load_steps':
        given = {'steps': 5, 'dwell': 0.5, **given}
    usual = machine.recordings['screen'].get(family, {}).get('settings', {})
    if 'acceleration' in usual:
        given.setdefault('acceleration', usual['acceleration'])
    return {'family': family, 'settings': given, 'duration': duration}


def _about_a_truth(case: Case, pair: Sequence[str]) -> bool:
    return any(set(pair) & fault.accepted and not set(pair) <= fault.accepted
               for fault in case.faults)


def _resolved(case: Case, report: Mapping[str, Any], pair: Sequence[str]) -> bool:
    """Whether a truth of the pair is named and no longer taken for the other one."""
    outcome = judged(case, report)
    for fault in case.faults:
        other = set(pair) - fault.accepted
        for one in outcome.named:
            if one.is_(fault) and one.effect in pair and not other & set(one.alike):
                return True
    return False
