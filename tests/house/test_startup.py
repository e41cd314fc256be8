"""What commands import before they do anything."""

import subprocess
import sys

import pytest

from servo_identify.cli import COMMANDS

HEAVY = {'torch', 'sklearn', 'pysindy', 'distributed', 'dask', 'mujoco', 'rclpy', 'control'}


def loaded(*arguments: str) -> set[str]:
    """Return the packages that `servo-identify` with these arguments has imported at its end."""
    code = ('import sys; from servo_identify.cli import main\n'
            'try: main(sys.argv[1:])\n'
            'except SystemExit: pass\n'
            'print("\\n" + " ".join({name.partition(".")[0] for name in sys.modules}))')
    done = subprocess.run([sys.executable, '-c', code, *arguments], capture_output=True, text=True,
                          check=True, timeout=120)
    return set(done.stdout.splitlines()[-1].split())


def test_the_overview_imports_no_numerics_at_all():
    assert not loaded('--help') & (HEAVY | {'numpy', 'numba', 'scipy', 'matplotlib', 'rich'})


@pytest.mark.parametrize('command', COMMANDS)
def test_the_help_of_a_command_imports_nothing_that_only_its_work_needs(command):
    assert not loaded(command, '--help') & (HEAVY | {'matplotlib'})
