"""
Fuzzes every reader for some minutes: `python tests/fuzz/fuzz.py --seconds 600`.

Each target runs in a process of its own with bounded memory. Findings are kept as files in
`--keep`, one for each place that broke, and the status is 1 where there is one.
"""

from __future__ import annotations

import argparse
import ast
from concurrent.futures import ThreadPoolExecutor
import json
import os
from pathlib import Path
import subprocess
import sys
import tempfile
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from target import Target
    from trial import Trials

HERE = Path(__file__).resolve().parent
CASES = HERE.parent / 'house' / 'fuzz_cases'


def main() -> int:
    """Run the targets side by side and say what came of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=600.0, help='of the whole run')
    parser.add_argument('--seed', default='1', help='another seed spoils otherwise')
    parser.add_argument('--jobs', type=int, default=2, help='targets side by side')
    parser.add_argument('--only', nargs='*', help='names of targets')
    parser.add_argument('--keep', type=Path, default=CASES, help='where findings are kept')
    parser.add_argument('--coverage', action='store_true', help='count the lines that were run')
    parser.add_argument('--guided', action='store_true', help='by coverage, with atheris')
    parser.add_argument('--json', type=Path, help='where to write the counts')
    parser.add_argument('--one', help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    sys.path.insert(0, str(HERE))
    from targets import seconds_of, TARGETS
    if arguments.one:
        return _one(arguments)
    names = arguments.only or list(TARGETS)
    seconds = seconds_of(names, arguments.seconds * arguments.jobs)
    with ThreadPoolExecutor(arguments.jobs) as pool:
        told = list(pool.map(lambda name: _apart(name, arguments, seconds[name]), names))
    print(f'{"target":10} {"inputs":>9} {"answered":>9} {"refused":>9} {"found":>6} '
          f'{"slowest, s":>10} {"of lines":>10}')
    for one in told:
        print(f'{one["target"]:10} {one["inputs"]:9} {one["answered"]:9} {one["refused"]:9} '
              f'{len(one["findings"]):6} {one["slowest"]:10.2f} {one.get("covered", ""):>10}')
        for said in one['findings']:
            print(f'    {said}')
    _say_families(told)
    if arguments.coverage:
        say_modules([one['lines'] for one in told if 'lines' in one])
    print(f'{sum(one["inputs"] for one in told)} inputs, seed {arguments.seed}, '
          f'{sum(len(one["findings"]) for one in told)} found')
    if arguments.json:
        arguments.json.write_text(json.dumps(told, indent=1))
    return int(any(one['findings'] for one in told))


def _say_families(told: list[dict]) -> None:
    """Print the inputs of each family."""
    from targets import FAMILIES, family_of
    print(f'\n{"family":10} {"inputs":>9} {"answered":>9} {"refused":>9}')
    for family in FAMILIES:
        found = [one for one in told if family_of(one['target']) == family]
        if found:
            counts = [sum(one[kind] for one in found)
                      for kind in ('inputs', 'answered', 'refused')]
            print(f'{family:10} ' + ' '.join(f'{count:9}' for count in counts))
    print()


def say_modules(told: list[dict[str, list[list[int]]]]) -> None:
    """Print how many lines of each parser were run by any target: [all, run] by its module."""
    print(f'{"parser":55} {"lines":>5} {"of lines":>8}')
    for module in sorted({name for one in told for name in one}):
        lines = {line for one in told for line in one.get(module, ([], []))[0]}
        run = {line for one in told for line in one.get(module, ([], []))[1]}
        print(f'{module:55} {len(lines):5} {100.0 * len(run) / max(1, len(lines)):6.0f} %')
    print()


def _apart(name: str, arguments: argparse.Namespace, seconds: float) -> dict:
    """Fuzz one target in another process; its death is a finding too."""
    with tempfile.TemporaryDirectory(prefix='servo_fuzz_') as scratch:
        command = [sys.executable, str(HERE / 'fuzz.py'), '--one', name, '--seconds', str(seconds),
                   '--seed', arguments.seed, '--keep', str(arguments.keep)]
        command += ['--coverage'] if arguments.coverage else []
        command += ['--guided'] if arguments.guided else []
        log = Path(scratch) / 'log'
        with log.open('wb') as output:
            ended = subprocess.run(command, cwd=scratch, stdout=output, stderr=subprocess.STDOUT,
                                   timeout=seconds + 120.0, check=False)
        answer = Path(scratch) / 'answer.json'
        if answer.exists() and not ended.returncode:
            return json.loads(answer.read_text())
        last = (Path(scratch) / 'last').read_bytes() if (Path(scratch) / 'last').exists() else b''
        _keep(arguments.keep, name, last)
        said = f'the process ended with {ended.returncode}: {log.read_text()[-300:]}'
        return {'target': name, 'inputs': 0, 'answered': 0, 'refused': 0, 'findings': [said],
                'slowest': 0.0}


def _one(arguments: argparse.Namespace) -> int:
    from targets import TARGETS
    from trial import limit_memory, tried
    target, coverage = TARGETS[arguments.one], None
    if arguments.coverage:
        from coverage import Coverage
        coverage = Coverage(data_file=None, source_pkgs=list(target.modules))
    limit_memory()
    last = os.open('last', os.O_CREAT | os.O_WRONLY)

    def remember(content: bytes) -> None:
        os.pwrite(last, content, 0)
        os.ftruncate(last, len(content))

    os.environ['SERVO_TWIN_CACHE'] = str(Path('cache').resolve())
    if arguments.guided:
        from guided import search
        search(target, Path('box/work').resolve(), arguments.seconds, remember,
               lambda trials: _tell(target, trials, arguments.keep))
    trials = tried(target, f'{arguments.seed} {target.name}', Path('box/work').resolve(),
                   arguments.seconds, before=remember,
                   ready=coverage.start if coverage else lambda: None)
    if coverage:
        coverage.stop()
    lines = _lines(coverage, target.modules) if coverage else {}
    _tell(target, trials, arguments.keep,
          **{'lines': lines, 'covered': _share(lines)} if coverage else {})
    return 0


def _tell(target: Target, trials: Trials, keep: Path, **more: object) -> None:
    """Keep the findings and write the counts down."""
    for content, _ in trials.findings.values():
        _keep(keep, target.name, content)
    told = {'target': target.name, 'inputs': trials.inputs, 'answered': trials.answered,
            'refused': trials.refused, 'slowest': trials.slowest,
            'findings': [said for _, said in trials.findings.values()]}
    Path('answer.tmp').write_text(json.dumps(told | more))
    Path('answer.tmp').rename('answer.json')


def _lines(coverage, modules: tuple[str, ...]) -> dict[str, list[list[int]]]:
    """Return the lines within functions of each parser, and those that were run."""
    found = {}
    for file in coverage.get_data().measured_files():
        module = next((one for one in modules
                       if Path(file).with_suffix('').as_posix().endswith(one.replace('.', '/'))),
                      None)
        if module is None:
            continue
        inside = {line for thing in ast.walk(ast.parse(Path(file).read_text()))
                  if isinstance(thing, ast.FunctionDef)
                  for line in range(thing.body[0].lineno, thing.end_lineno + 1)}
        _, all_lines, _, missing, _ = coverage.analysis2(file)
        lines = inside.intersection(all_lines)
        found[module] = [sorted(lines), sorted(lines.difference(missing))]
    return found


def _share(lines: dict[str, list[list[int]]]) -> str:
    """Return the share of lines that were run."""
    every = sum(len(all_lines) for all_lines, _ in lines.values())
    return f'{100.0 * sum(len(run) for _, run in lines.values()) / max(1, every):.0f} %'


def _keep(folder: Path, name: str, content: bytes) -> None:
    from trial import named
    (folder / name).mkdir(parents=True, exist_ok=True)
    (folder / name / named(content)).write_bytes(content)


if __name__ == '__main__':
    sys.exit(main())
