"""The command `servo-twin`: each subcommand is a module of its own, imported when it is called."""

from __future__ import annotations

import argparse
from contextlib import redirect_stdout
from functools import partial
from importlib import import_module
from importlib.metadata import entry_points, version
import os
import sys
from types import ModuleType
from typing import NoReturn

COMMANDS = {
    'run': ('.commands.run',
            'rig, driver, twin and recorder side by side, with a live view and a page'),
    'view': ('.commands.view', 'a running rig and its twin, or a bag, in the browser'),
    'replay': ('.commands.replay',
               'answer a bag as fast as the machine goes, or play it into ROS'),
    'linearise': ('.commands.linearise',
                  'transfer function, state space, Bode and step plots of a servo'),
    'from-mjcf': ('.commands.from_mjcf', 'a servo file of what MuJoCo has of a joint'),
    'from-urdf': ('.commands.from_urdf', 'a servo file of what a URDF file has of a joint'),
    'export': ('.commands.export', 'a servo as the joint of MuJoCo, URDF or Isaac Lab'),
    'parameters': ('.commands.parameters', 'list what a servo file may say: value, unit, bounds'),
}
"""Subcommand: its module, which has `add_arguments(parser)` and `main(arguments)`; a summary."""


def main(argv: list[str] | None = None) -> int:
    """Run a subcommand of `servo-twin` and return its exit status."""
    return dispatch('servo-twin', 'A servo and its digital twin, side by side.', COMMANDS,
                    __package__, argv)


def added_commands(group: str) -> dict[str, tuple[str, str]]:
    """
    Return the subcommands that other installed packages add by entry points of a group.

    Their summary is empty; the overview takes the first sentence of the module.
    """
    return {one.name: (one.value, '') for one in entry_points(group=group)}


def dispatch(program: str, about: str, commands: dict[str, tuple[str, str]], package: str,
             argv: list[str] | None) -> int:
    """
    Run a subcommand and return its exit status.

    0: done, 1: not as expected, 2: cannot be, 3: a gap is there (`diagnose --fail-on`), 130:
    interrupted.

    ``commands`` maps a subcommand to its module, relative to ``package``, and a summary; the
    module has `add_arguments(parser)` and `main(arguments)`. With --json what the module keeps
    by `tell` is written when it ends, also where it ends by an error.
    """
    argv = sys.argv[1:] if argv is None else argv
    if argv == ['--version']:
        print(f'{program} {_version(program)}')
        return 0
    if argv[:1] == ['--completion']:
        from .description.completion import script
        print(script(program, {name: _parser(program, name, commands, package)[1]
                               for name in commands}, argv[1:]), end='')
        return 0
    if not argv or argv[0] not in commands:
        return _overview(program, about, commands, argv)
    try:  # from here on, so that Ctrl-C while modules are loaded says nothing more than later
        module, parser = _parser(program, argv[0], commands, package)
        return _run(module, parser.parse_args(argv[1:]), program, argv[0])
    except KeyboardInterrupt:
        return 130


def _run(module: ModuleType, arguments: argparse.Namespace, program: str, name: str) -> int:
    """Run a subcommand; with `--json -` what people read goes to stderr."""
    from .commands.terminal import judged_file, spare_what_is_read, write_json

    def say(problem: Exception) -> str:
        said = str(problem.args[0] if isinstance(problem, KeyError) else problem)
        print(f'{program} {name}: {said}', file=sys.stderr)
        return said

    stdout, status, end = sys.stdout, 2, {}
    arguments.write_json = partial(write_json, arguments, stdout, {
        'made_by': f'{program} {name} {_version(program)}'})
    try:
        spare_what_is_read(arguments)
        if arguments.json not in (None, '-'):
            judged_file(arguments.json, arguments.force)
    except (ValueError, OSError) as problem:
        say(problem)
        return status
    try:
        with redirect_stdout(sys.stderr if arguments.json == '-' else stdout):
            status = module.main(arguments)
        stdout.flush()
    except BrokenPipeError:  # who reads has left, as `head` does: what is left is for nobody
        os.dup2(os.open(os.devnull, os.O_WRONLY), stdout.fileno())
        return 141  # as of a program that SIGPIPE ended; 1 is an answer of some commands
    except (ValueError, KeyError, OSError) as problem:
        end['error'] = say(problem)
    except MemoryError as problem:
        end['error'] = say(MemoryError('this machine has too little memory for it; take fewer or '
                                       f'shorter recordings ({problem or "no number is told"})'))
    except KeyboardInterrupt:
        status = 130
    try:
        arguments.write_json({'exit_status': status, **end})
    except (ValueError, OSError) as problem:
        say(problem)
        return 2
    return status


class _Parser(argparse.ArgumentParser):
    """A parser that says in one sentence what is wrong, without the usage of all options above."""

    def error(self, message: str) -> NoReturn:
        """End with the sentence and status 2."""
        self.exit(2, f'{self.prog}: {message}; --help says what there is\n')


def _parser(program: str, name: str, commands: dict[str, tuple[str, str]], package: str
            ) -> tuple[ModuleType, argparse.ArgumentParser]:
    from .commands.terminal import add_usual

    module = import_module(commands[name][0], package)
    parser = _Parser(
        prog=f'{program} {name}', description=module.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    module.add_arguments(parser)
    add_usual(parser, f'{program} {_version(program)}')
    return module, parser


def _version(program: str) -> str:
    return version(program.replace('-', '_'))


def _overview(program: str, about: str, commands: dict, argv: list[str]) -> int:
    lines = [f'usage: {program} COMMAND ...', '', about, '']
    wide = max(len(name) for name in commands) + 2
    lines += [f'  {name:<{wide}}{summary or _first_sentence(module)}'
              for name, (module, summary) in commands.items()]
    lines += ['', f'{program} COMMAND --help says more; {program} --version says which it is; '
              f'{program} --completion', 'bash or zsh prints what completes it. Exit status: 0 '
              'done, 1 not as expected, 2 cannot be, 3 a', 'gap is there (diagnose --fail-on), '
              '130 interrupted.']
    wanted = not argv or argv[0] in ('-h', '--help', 'help')
    if not wanted:
        from .description.nearest_name import or_what
        lines.insert(0, f'{program}: there is no command {argv[0]!r}; '
                     f'{or_what(argv[0], commands)}')
    print('\n'.join(lines), file=sys.stdout if wanted else sys.stderr)
    return 0 if wanted else 2


def _first_sentence(module: str) -> str:
    """Return what the docstring of a module begins with, as a summary."""
    said = ' '.join((import_module(module).__doc__ or '').split('.\n')[0].split())
    return said[:1].lower() + said[1:]


if __name__ == '__main__':
    sys.exit(main())
