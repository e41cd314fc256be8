"""Writes the cases of a seed as folders: python -m servo_studies.third_rig SEED -o DIR."""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
import time

from .case_folder import write_case
from .fault_cases import cases, KINDS
from .fault_terms import MECHANISMS


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(prog='python -m servo_studies.third_rig', description=__doc__)
    parser.add_argument('seed', type=int, nargs='?', metavar='CASE_SEED')
    parser.add_argument('-o', '--output', type=Path, help='folder, one below it for each case')
    parser.add_argument('--first', type=int, metavar='N', help='only the first N, a fair mix')
    parser.add_argument('--kind', action='append', choices=KINDS, help='only this kind')
    parser.add_argument('--list', action='store_true', help='name the cases and make nothing')
    parser.add_argument('--mechanisms', action='store_true', help='print what there is, with laws')
    given = parser.parse_args(arguments)
    if given.mechanisms:
        for one in MECHANISMS.values():
            print(f'{one.name} at {", ".join(one.sites)}' + (
                f' (unlisted: {one.balance}, {", ".join(one.variables)})' if one.balance else ''))
            print(*(f'    {curve}: {law}' for curve, law in one.curves.items()), sep='\n')
        return 0
    if given.seed is None or not (given.output or given.list):
        parser.error('CASE_SEED and -o DIR are needed (or --list, or --mechanisms)')
    for case in cases(given.seed, given.first):
        if given.kind and case.kind not in given.kind:
            continue
        faults = ', '.join(f'{one.mechanism} at {one.site} ({one.curve}) x {severity:g}'
                           for one, severity in zip(case.faults, case.severities, strict=True))
        print(f'{case.name}: {case.style}, lacks {faults or "nothing"}', flush=True)
        if not given.list:
            begun = time.perf_counter()
            write_case(case, given.output)
            print(f'    {len(case.recordings)} recordings, shows {case.shows():.3g}, '
                  f'{time.perf_counter() - begun:.1f} s', flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
