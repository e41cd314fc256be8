"""
Sets the workspace up: Python environment, ROS 2 wheels, messages, packages.

Needs nothing but a Python 3.11 or 3.12 with its headers and a C++ compiler. A stage runs only
when what it depends on has changed since it last finished; with nothing changed the call returns
at once.
"""

import argparse
from collections.abc import Callable
import fcntl
import os
from pathlib import Path
import platform
import sys
import time

from fingerprints import build_print, environment_print, packages_print, read_stamp, write_stamp
from machine import (
    require_compiler,
    require_headers,
    require_python,
    SetupError,
    sourced_ros,
    StageError,
)
from stages import Workspace

ROOT = Path(__file__).resolve().parent.parent
TAIL = 30  # lines of the log shown on failure


def wanted_stamp(root: Path, sourced: bool, training: bool) -> dict[str, str]:
    """
    Return the hash that each wanted stage has once it is done for the files as they are now.

    The stage ``training`` is wanted only where it is asked for.
    """
    base = str(Path(getattr(sys, '_base_executable', sys.executable)).resolve())
    ros = os.environ['AMENT_PREFIX_PATH'].split(os.pathsep)[-1] if sourced else ''
    environment = environment_print(root, base, platform.python_version(), ros)
    packages = packages_print(root, environment)
    wanted = {'environment': environment, 'packages': packages,
              'build': build_print(root, packages)}
    return wanted | {'training': packages} if training else wanted


def _tail(log_path: Path) -> str:
    lines = log_path.read_text(errors='replace').splitlines()
    return '\n'.join([line for line in lines if not line.startswith('WARNING:')][-TAIL:])


def _say(text: str, end: str = '\n') -> None:
    print(text, end=end, flush=True)


def bring_up(root: Path, workspace: Workspace, wanted: dict[str, str]) -> None:
    """Run every wanted stage that is not done, in order, and note each one as it finishes."""
    stages: list[tuple[str, str, Callable[[], bool | None]]] = [
        ('environment', 'virtual environment in .venv', workspace.make_environment),
        ('packages', 'packages (about a minute)', workspace.install_packages),
        ('build', 'messages and nodes (about half a minute)', workspace.build),
        ('training', 'torch, for training only', workspace.install_training),
    ]
    stages = [stage for stage in stages if stage[0] in wanted]
    done = read_stamp(root)
    for number, (name, title, stage) in enumerate(stages, 1):
        if done.get(name) == wanted[name]:
            continue
        _say(f'set-up {number}/{len(stages)}: {title} ...', end='')
        started = time.monotonic()
        try:
            answer = stage()
        except SetupError:
            _say(' failed')
            raise
        outcome = 'not to be had here; all but training works' if answer is False else 'done'
        _say(f' {outcome} ({time.monotonic() - started:.0f} s)')
        done = (done if name != 'environment' else {}) | {name: wanted[name]}
        write_stamp(root, done)


def set_up(root: Path, training: bool = False) -> bool:
    """
    Bring the workspace at root up to date; return whether anything had to be done.

    ``training`` asks for what only the training of networks needs.

    Raises SetupError, with one sentence for a person.
    """
    require_python()
    sourced = sourced_ros()
    wanted = wanted_stamp(root, sourced, training)
    if wanted.items() <= read_stamp(root).items():
        return False
    require_compiler()
    require_headers()
    lock = os.open(root, os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        log_path = root / 'log' / 'setup.log'
        log_path.parent.mkdir(exist_ok=True)
        with log_path.open('w') as log:
            try:
                bring_up(root, Workspace(root, sourced, log), wanted)
            except StageError as error:
                log.flush()
                raise StageError(f'{error}; the end of {log_path}:\n{_tail(log_path)}') from error
    finally:
        os.close(lock)
    return True


def main() -> int:
    """Set the workspace up; return the exit status."""
    parser = argparse.ArgumentParser(description='Set the workspace up.')
    parser.add_argument('--verbose', action='store_true', help='say so when nothing is to be done')
    parser.add_argument('--training', action='store_true',
                        help='also install torch, which only the training of networks needs')
    arguments = parser.parse_args()
    try:
        worked = set_up(ROOT, arguments.training)
    except SetupError as error:
        print(f'set-up: {error}', file=sys.stderr)
        return 1
    if arguments.verbose and not worked:
        _say('set-up: up to date')
    return 0


if __name__ == '__main__':
    sys.exit(main())
