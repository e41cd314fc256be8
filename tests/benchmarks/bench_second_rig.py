"""
The diagnosis on a second rig: other laws, other machines, other excitations than the blind check.

    python tests/benchmarks/bench_second_rig.py SEED [--size 1.5] [--cases 56] [--case N ...]
                                                [--silent torque load_position]

Draws cases from SEED: one of three machines whose values are drawn about those of a class, what
its servo file lacks (--size times a tenth of the rated torque or torsion, or what is as easily
seen), and four to six families of recordings of ten seconds, three replicates each, which
`diagnose` parts itself. Of eight cases four lack one thing and one lacks two, in two the true
cause is taken out of the catalogue or was never in it, in one nothing is lacking. --silent takes
channels away, and the cases that only they could show. Prints a line for each case and what they
come to; with --case those alone, with the warnings.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
import zlib

import numpy as np
from second_rig import Machine, record
from second_rig_machines import CLASSES, Lack, LACKS, ONLY, servo_of
from second_rig_motions import motion

if TYPE_CHECKING:
    from servo_studies.blind_check.case_outcome import Outcome

REPLICATES = 3


@dataclass(frozen=True)
class Case:
    """One case: the class of machine, what it lacks, whether the catalogue has that, a seed."""

    number: int
    machine: str
    lacks: tuple[str, ...]
    removed: bool
    seed: int
    size: float
    silent: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What it lacks, for a person."""
        lacks = ' + '.join(self.lacks) or 'nothing'
        return f'{self.number:03d} {self.machine}, {lacks}{" (removed)" * self.removed}'

    @property
    def kind(self) -> str:
        """The kind of case, as the blind check has them."""
        if self.removed or not self.lacks:
            return 'removed' if self.removed else 'null'
        return 'pair' if len(self.lacks) > 1 else 'single'

    @property
    def faults(self) -> tuple[Lack, ...]:
        """What it lacks; which shaft a torque brakes, its sensor alone tells."""
        several = tuple(LACKS[name] for name in self.lacks)
        return tuple(replace(one, site='') for one in several) if 'torque' in self.silent else (
            several)

    def without(self, values: Iterable[str]) -> tuple[str, ...]:
        """What the catalogue shall not have, of a servo with these values (paths)."""
        if not self.removed:
            return ()
        of_servo = {f'parameter:{path.removeprefix(start)}' for path in values
                    for start in ('drive.', 'mechanism.', 'effects.') if path.startswith(start)}
        return tuple(name for name in LACKS[self.lacks[0]].names
                     if not name.startswith('parameter:') or name in of_servo)


def cases(seed: int, size: float, count: int, silent: tuple[str, ...] = ()) -> list[Case]:
    """Draw cases; what is lacking comes in turn, in an order of its own."""
    rng = np.random.default_rng(seed)
    seen = {name: lack for name, lack in LACKS.items() if _shows(lack, name, silent)}
    known = [name for name, lack in seen.items() if lack.names]
    turns = {kind: _in_turn(rng, pool) for kind, pool in (
        ('single', known), ('pair', known),
        ('removed', [name for name, lack in seen.items() if not lack.names
                     or any(not other.startswith('parameter') for other in lack.names)]))}
    drawn = []
    for number in range(count):
        kind = ('single', 'removed', 'single', 'pair', 'single', 'removed', 'single',
                'nothing')[number % 8]
        lacks = () if kind == 'nothing' else (next(turns[kind]),)
        machines = [name for name in CLASSES if name in ONLY.get((*lacks, '')[0], CLASSES)]
        machine = str(rng.choice(machines))
        while kind == 'pair' and len(lacks) < 2:
            other = next(turns['pair'])
            if machine in ONLY.get(other, CLASSES) and _apart(lacks[0], other):
                lacks = (*lacks, other)
        drawn.append(Case(number, machine, lacks, kind == 'removed', int(rng.integers(2**31)),
                          size, silent))
    return drawn


def _shows(lack: Lack, name: str, silent: tuple[str, ...]) -> bool:
    """Tell whether channels that are left could show something."""
    if 'torque' in silent and name.startswith('torque_sensor'):
        return False
    return 'load_position' not in silent or lack.balances[0] != 'transmission'


def _in_turn(rng: np.random.Generator, pool: list[str]) -> Iterator[str]:
    while True:
        yield from (str(one) for one in rng.permutation(pool))


def _apart(one: str, other: str) -> bool:
    """Tell whether two things have neither names nor properties in common."""
    if set(LACKS[one].names) & set(LACKS[other].names):
        return False
    of, rng = CLASSES['robot joint'], np.random.default_rng(0)
    properties = [set(LACKS[name].change(of.machine, of.torque, of.speed, 1.0, rng))
                  for name in (one, other)]
    return not properties[0] & properties[1]


def make(case: Case) -> tuple[Machine, list[tuple[str, int, dict[str, np.ndarray]]]]:
    """Return (what the servo file says, recordings of the rig: family, replicate, columns)."""
    rng = np.random.default_rng(case.seed)
    of = CLASSES[case.machine]
    about = {name: getattr(of.machine, name) * float(np.exp(rng.uniform(-0.3, 0.3)))
             for name in of.tolerances if name not in ('gain', 'back_emf')}
    if of.machine.resistance:
        about['back_emf'] = about['torque_constant']
    told = of.machine._replace(**about)
    reach = 0.25 if case.lacks else 0.9
    rig = told._replace(**{name: getattr(told, name) * (1 + reach * share * rng.uniform(-1, 1))
                           for name, share in of.tolerances.items()})
    for lack in case.lacks:
        rig = rig._replace(**LACKS[lack].change(rig, of.torque, of.speed, case.size, rng))
    families = ['ladder', 'reversals', 'multisine', *rng.choice(
        ['load_steps', 'chirp', 'turns', 'moves', 'steps'], rng.integers(1, 4), replace=False)]
    made = []
    for family in families:
        settings = np.random.default_rng(rng.integers(2**31))
        position, speed, external = motion(str(family), of, told, settings)
        made += [(str(family), n, record(rig, position, speed, external, int(rng.integers(2**31))))
                 for n in range(1, REPLICATES + 1)]
    return told, made


def diagnosed(case: Case) -> tuple[Case, str, list[str]]:
    """Return (case, what its diagnosis comes to, what it said)."""
    import yaml

    from servo_identify.diagnose.checks import CannotDiagnose
    from servo_identify.diagnose.diagnose import diagnose
    from servo_studies.blind_check.case_outcome import judged
    from servo_twin.description import servo_file
    from servo_twin.recording.recording import Recording

    told, made = make(case)
    servo = servo_file.loads(yaml.safe_dump(servo_of(case.machine, told, case.silent)))
    recordings = [Recording(
        f'{family}-{n}', told.period,
        {name: np.ascontiguousarray(column) for name, column in columns.items()
         if name not in case.silent}, family=family, replicate=n, servo=servo.name,
        digest=f'{zlib.crc32(f"{case.seed} {family} {n} {case.silent}".encode()):064x}')
        for family, n, columns in made]
    try:
        report = diagnose(recordings, servo, without=case.without(servo.values)).report
    except CannotDiagnose as problem:
        return case, 'failed', [str(problem)]
    said = [' or '.join((f'{one.effect} ({one.site})', *one.ambiguous_with))
            for one in report.which]
    lines = [f"{report.verdict['status']}: {'; '.join(said)}", *report.warnings]
    return case, word_for(judged(case, report.as_dict())), lines


def word_for(outcome: Outcome) -> str:
    """Return the verdict of the blind check in a word, of a wrong one what is wrong with it."""
    if outcome.verdict != 'wrong' or outcome.case.kind == 'null':
        return outcome.verdict
    if outcome.case.kind == 'removed':
        return 'wrong, flagged' if outcome.says_unknown else 'wrong'
    if outcome.first_right:
        return 'right and more'
    return 'in set' if outcome.in_set else 'wrong'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('seed', type=int)
    parser.add_argument('--size', type=float, default=1.5)
    parser.add_argument('--cases', type=int, default=56)
    parser.add_argument('--case', type=int, nargs='+', default=[])
    parser.add_argument('--silent', nargs='+', default=[], choices=('torque', 'load_position'))
    told = parser.parse_args()
    drawn = cases(told.seed, told.size, told.cases, tuple(told.silent))
    seen: Counter[tuple[str, str]] = Counter()
    with ProcessPoolExecutor() as pool:
        for case, word, lines in pool.map(diagnosed, [drawn[n] for n in told.case] or drawn):
            seen[case.kind, word] += 1
            print(f'{word:<15}{case.name:<60} {lines[0]}', flush=True)
            for line in lines[1:] if told.case else ():
                print(f'{"":<15}{line}')
    for (kind, word), number in sorted(seen.items()):
        print(f'{kind:<10}{word:<15}{number}')


if __name__ == '__main__':
    main()
