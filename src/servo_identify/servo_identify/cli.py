"""The command `servo-identify`: each subcommand is a module of its own, imported when called."""

from __future__ import annotations

import argparse
from importlib import import_module
import sys

COMMANDS = {
    'import': ('.importing', 'make a bag of a table: CSV, Parquet, or MAT and JSON by a mapping'),
    'info': ('.info', 'say what bags hold: duration, rate, channels, ranges, gaps, warnings'),
    'experiment': ('.experiment.command', 'drive a rig through a procedure and record its bags'),
    'diagnose': ('.gap.command', 'where the gap lies, which effect causes it, how far it shrinks'),
    'online': ('.online.command', 'replay the online estimator over a bag, and draw it'),
    'fit': ('.fitting.command', 'fit parameters, or learn an effect, and write a servo file'),
    'friction': ('.friction.command', 'learn friction by every learner and compare them'),
    'results': ('.real.command', 'figures on recordings of real machines beside those published'),
    'blind-check': ('.blind.command', 'score the diagnosis on rigs with effects withheld'),
}
"""Subcommand: its module, which has `add_arguments(parser)` and `main(arguments)`; a summary."""


def main(argv: list[str] | None = None) -> int:
    """Run a subcommand and return its exit status: 0 done, 1 not as expected, 2 cannot be."""
    argv = sys.argv[1:] if argv is None else argv
    if not argv or argv[0] not in COMMANDS:
        return _overview(argv)
    module = import_module(COMMANDS[argv[0]][0], __package__)
    parser = argparse.ArgumentParser(
        prog=f'servo-identify {argv[0]}', description=module.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    module.add_arguments(parser)
    arguments = parser.parse_args(argv[1:])
    try:
        return module.main(arguments)
    except (ValueError, KeyError, OSError) as problem:
        said = problem.args[0] if isinstance(problem, KeyError) else problem
        print(f'servo-identify {argv[0]}: {said}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


def _overview(argv: list[str]) -> int:
    lines = ['usage: servo-identify COMMAND ...', '',
             'Recordings, identified servo models and the gap between rig and twin.', '']
    lines += [f'  {name:<14}{summary}' for name, (_, summary) in COMMANDS.items()]
    lines += ['', 'servo-identify COMMAND --help says more.']
    wanted = not argv or argv[0] in ('-h', '--help', 'help')
    if not wanted:
        lines.insert(0, f'servo-identify: there is no command {argv[0]!r}; '
                        f'there are {list(COMMANDS)}')
    print('\n'.join(lines), file=sys.stdout if wanted else sys.stderr)
    return 0 if wanted else 2


if __name__ == '__main__':
    sys.exit(main())
