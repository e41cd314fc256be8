"""
The diagnosis on the third rig, which was written from the literature alone.

    python tests/benchmarks/bench_third_rig.py SEED [--first 24] [--kind one] [--case N ...]

Draws cases from SEED, makes the recordings of each and asks what its servo file lacks. An effect
is right by its name; where the servo file has the law already, a value of it is the same.
Prints a line for each case and what they come to, by kind; with --case those alone, in full. A
rig that runs away in one of its motions is no case.
"""

from __future__ import annotations

import argparse
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
import zlib

import numpy as np

from servo_studies.third_rig.bench_run import Diverged
from servo_studies.third_rig.fault_case import Case
from servo_studies.third_rig.fault_cases import cases, KINDS


def diagnosed(case: Case) -> tuple[str, list[str]]:
    """Return a word for the answer to a case, and what it said."""
    from servo_identify.diagnose.checks import CannotDiagnose
    from servo_identify.diagnose.diagnose import diagnose
    from servo_twin.description import servo_file
    from servo_twin.recording.recording import Recording

    servo = servo_file.loads(case.servo)
    try:
        made = case.recordings
    except Diverged as problem:  # it copes with the motion by which its severity was found
        return 'no case', [str(problem)]
    recordings = [Recording(
        one.name, one.period, {n: np.ascontiguousarray(c) for n, c in one.columns.items()
                                 if n != 't'},
        family=one.family, replicate=one.replicate, servo=servo.name,
        digest=f'{zlib.crc32(f"{case.name} {one.name}".encode()):064x}')
        for one in made]
    try:
        report = diagnose(recordings, servo).report
    except CannotDiagnose as problem:
        return 'refused', [str(problem)]
    laws = {placed.name: placed.effect.name for placed in servo.effects}
    named = [_plain(one.effect, laws) for one in report.which]
    listed = [{_plain(other, laws) for other in one.ambiguous_with} for one in report.which]
    status = report.verdict['status']
    return word_for(case, named, listed, status), [report.verdict['sentence'], *report.warnings]


def _plain(effect: str, laws: dict[str, str]) -> str:
    """Return the law whose value is said to be off, or the effect as it is."""
    instance = effect.removeprefix('parameter:').partition('.')[0]
    return laws.get(instance, effect) if effect.startswith('parameter:') else effect


def word_for(case: Case, named: list[str], listed: list[set[str]], status: str) -> str:
    """Return what an answer is: right, in set, right and more, partly, unknown, unseen, wrong."""
    truth = [effect for effect, _ in case.truth]
    if not case.faults:
        return 'right' if status == 'no_gap' else 'wrong' if named else 'unknown'
    if not named:
        said = status in ('unknown', 'partly_explained')
        return ('right' if not truth else 'unknown') if said else 'unseen'
    if not truth:
        return 'wrong'
    right = [name in truth for name in named]
    if all(right):
        return 'right' if set(truth) <= set(named) else 'partly'
    if right[0]:
        return 'right and more'
    return 'in set' if set(truth) & listed[0] else 'wrong'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('seed', type=int)
    parser.add_argument('--first', type=int, default=24)
    parser.add_argument('--kind', choices=KINDS)
    parser.add_argument('--case', type=int, nargs='+', default=[])
    told = parser.parse_args()
    drawn = cases(told.seed, max([told.first, *(n + 1 for n in told.case)]))
    drawn = [drawn[n] for n in told.case] or [
        one for one in drawn if told.kind in (None, one.kind)]
    seen: Counter[tuple[str, str]] = Counter()
    with ProcessPoolExecutor() as pool:
        for case, (word, lines) in zip(drawn, pool.map(diagnosed, drawn), strict=True):
            seen[case.kind, word] += 1
            lacks = ', '.join(f'{one.mechanism} ({one.curve}) at {one.site} x {severity:g}'
                              for one, severity in zip(case.faults, case.severities, strict=True))
            print(f'{word:<15}{case.name}, {case.style}, lacks {lacks or "nothing"}', flush=True)
            for line in lines if told.case else lines[:1]:
                print(f'{"":<15}{line}')
    for (kind, word), number in sorted(seen.items()):
        print(f'{kind:<15}{word:<15}{number}')


if __name__ == '__main__':
    main()
