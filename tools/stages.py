"""The stages of the set-up: virtual environment, packages, messages and nodes, training."""

import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import sysconfig
from typing import TextIO

from machine import has_ensurepip, has_pip, missing_build_tools, SetupError, StageError

COLCON = 'import sys; from colcon_core.command import main; sys.exit(main())'
# Where the wheels' CMake files look for Python and numpy: on the machine that made them.
FOREIGN_PYTHON = re.compile(r'/opt/python/cp3\d+-cp3\d+/include/python3\.\d+')
FOREIGN_NUMPY = re.compile(
    r'/opt/python/cp3\d+-cp3\d+/lib/python3\.\d+/site-packages/numpy/_core/include')


class Workspace:
    """The workspace at root: everything that the set-up makes lies below it."""

    def __init__(self, root: Path, sourced: bool, log: TextIO):
        self.root = root
        self.sourced = sourced
        self.log = log
        self.venv = root / '.venv'
        self.python = self.venv / 'bin' / 'python'

    def run(self, *command: str | Path, **variables: str) -> int:
        """Run a command in root, its output in the log; return its exit status."""
        kept = dict(os.environ)
        if not self.sourced:
            # What another environment put there must not answer for what is missing here.
            for name in ('PYTHONPATH', 'AMENT_PREFIX_PATH', 'CMAKE_PREFIX_PATH',
                         'LD_LIBRARY_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE'):
                kept.pop(name, None)
        self.log.write(f'\n$ {" ".join(map(str, command))}\n')
        self.log.flush()
        return subprocess.run(
            list(map(str, command)), cwd=self.root, env=kept | variables, check=False,
            stdin=subprocess.DEVNULL, stdout=self.log, stderr=subprocess.STDOUT).returncode

    def pip(self, *arguments: str | Path) -> int:
        """Run pip install in the environment; return its exit status."""
        return self.run(self.python, '-m', 'pip', 'install', '--quiet',
                        '--disable-pip-version-check', *arguments)

    def make_environment(self) -> None:
        """Make .venv anew, with pip in it; what was built for the old one goes too."""
        for name in ('.venv', 'build', 'install'):
            shutil.rmtree(self.root / name, ignore_errors=True)
        base = getattr(sys, '_base_executable', sys.executable)
        command = [base, '-m', 'venv', self.venv]
        if self.sourced:
            command.append('--system-site-packages')
        if has_ensurepip():
            done = self.run(*command) == 0
        elif has_pip():
            done = (self.run(*command, '--without-pip') == 0 and
                    self.run(base, '-m', 'pip', '--python', self.python, 'install', 'pip') == 0)
        else:
            major, minor = sys.version_info[:2]
            raise SetupError(f'{base} can make no virtual environment with pip: '
                             f'on Debian or Ubuntu, apt install python{major}.{minor}-venv')
        if not done:
            raise StageError(f'{base} made no virtual environment in {self.venv}')

    def install_packages(self) -> None:
        """Install what requirements/ names, and repair what the wheels carry wrongly."""
        requirements = self.root / 'requirements'
        ros = 'ros_sourced.txt' if self.sourced else 'ros_wheels.txt'
        wanted = ['-r', requirements / 'workspace.txt', '-r', requirements / ros]
        tools = missing_build_tools()
        if tools:
            wanted += ['-c', requirements / 'build_tools.txt', *tools]
        if self.pip(*wanted):
            raise StageError('pip could not install the packages of requirements/')
        if not self.sourced:
            repair_cmake_files(self.venv / 'share', self._numpy_include())

    def install_training(self) -> bool:
        """Install torch where its small CPU build is to be had; return whether it is."""
        requirements = self.root / 'requirements'
        return self.pip('-c', requirements / 'workspace.txt',
                        '-r', requirements / 'training.txt') == 0

    def build(self) -> None:
        """Build the messages and link the packages into install/."""
        places = [str(self.venv)] if not self.sourced else []
        prefixes = {name: os.pathsep.join(
            places + ([os.environ[name]] if self.sourced and os.environ.get(name) else []))
            for name in ('AMENT_PREFIX_PATH', 'CMAKE_PREFIX_PATH')}
        path = f'{self.venv / "bin"}{os.pathsep}{os.environ["PATH"]}'
        status = self.run(
            self.python, '-c', COLCON, 'build', '--merge-install', '--symlink-install',
            '--base-paths', 'src', '--cmake-args', '-G', 'Ninja',
            '-DBUILD_TESTING=OFF', '-DCMAKE_BUILD_TYPE=Release',
            f'-DPython3_EXECUTABLE={self.python}', PATH=path, **prefixes)
        if status:
            raise StageError('colcon could not build the packages of src/')

    def _numpy_include(self) -> str:
        return subprocess.run(
            [self.python, '-c', 'import numpy; print(numpy.get_include())'],
            capture_output=True, text=True, check=True).stdout.strip()


def repair_cmake_files(folder: Path, numpy_include: str) -> int:
    """
    Point the wheels' CMake files below folder at this machine's Python and numpy.

    They carry the include paths of the machine they were built on. Returns how many changed.
    """
    python_include = sysconfig.get_paths()['include']
    changed = 0
    for path in folder.rglob('*.cmake'):
        text = path.read_text(encoding='utf-8')
        repaired = FOREIGN_PYTHON.sub(python_include, FOREIGN_NUMPY.sub(numpy_include, text))
        if repaired != text:
            path.write_text(repaired, encoding='utf-8')
            changed += 1
    return changed
