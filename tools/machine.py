"""What the machine must have before the workspace can be set up, and what it has."""

import importlib.util
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import sysconfig

PYTHONS = ((3, 11), (3, 12))
OLDEST_CMAKE = (3, 20)


class SetupError(Exception):
    """The set-up cannot go on; the message is one sentence that says what to do."""


class StageError(SetupError):
    """A command of a stage failed; the log tells more."""


def version_of(command: str) -> str | None:
    """Return the first line of `command --version`, or None where it does not run."""
    if shutil.which(command) is None:
        return None
    try:
        answer = subprocess.run([command, '--version'], capture_output=True, text=True,
                                timeout=30, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return answer.stdout.partition('\n')[0] if answer.returncode == 0 else None


def require_python(version: tuple[int, ...] = sys.version_info[:2]) -> None:
    """Raise SetupError unless this is a Python that the ROS 2 wheels are made for."""
    if tuple(version) not in PYTHONS:
        raise SetupError(f'Python {version[0]}.{version[1]} is not one of 3.11 and 3.12, for '
                         'which ROS 2 Jazzy is made: name one by make PYTHON=...')


def require_headers() -> None:
    """Raise SetupError where Python.h, which message modules are compiled with, is absent."""
    header = Path(sysconfig.get_paths()['include']) / 'Python.h'
    if not header.is_file():
        major, minor = sys.version_info[:2]
        raise SetupError(f'{header} is missing, and messages cannot be compiled without it: '
                         f'on Debian or Ubuntu, apt install python{major}.{minor}-dev')


def require_compiler() -> str:
    """Return the name of a C++ compiler that runs; SetupError where there is none."""
    wanted = os.environ.get('CXX')
    names = [wanted] if wanted else ['c++', 'g++', 'clang++']
    for name in names:
        if version_of(name) is not None:
            return name
    raise SetupError(f'no C++ compiler runs here (tried {", ".join(names)}): '
                     'on Debian or Ubuntu, apt install g++')


def missing_build_tools() -> list[str]:
    """Return which of cmake and ninja the machine lacks or has too old."""
    found = re.search(r'(\d+)\.(\d+)', version_of('cmake') or '')
    too_old = found is None or tuple(map(int, found.groups())) < OLDEST_CMAKE
    missing = ['cmake'] if too_old else []
    return missing if version_of('ninja') is not None else [*missing, 'ninja']


def sourced_ros() -> bool:
    """
    Return whether a ROS 2 Jazzy installation is sourced in this shell.

    Raises SetupError where another distribution is sourced.
    """
    distribution = os.environ.get('ROS_DISTRO', '')
    if not distribution or not os.environ.get('AMENT_PREFIX_PATH'):
        return False
    if distribution != 'jazzy':
        raise SetupError(f'ROS 2 {distribution} is sourced in this shell, and the workspace is '
                         'for jazzy: source that one, or use a shell with none')
    return True


def has_ensurepip() -> bool:
    """Return whether this Python can put pip into a new environment by itself."""
    return importlib.util.find_spec('ensurepip') is not None


def has_pip() -> bool:
    """Return whether this Python has a pip of its own."""
    return importlib.util.find_spec('pip') is not None
