"""What commands import before they do anything: none of what only their work needs."""

import subprocess
import sys

import pytest

from servo_identify.cli import COMMANDS as OF_IDENTIFY
from servo_twin.cli import added_commands
from servo_twin.cli import COMMANDS as OF_TWIN

HEAVY = {'torch', 'sklearn', 'pysindy', 'distributed', 'dask', 'mujoco', 'rclpy', 'control',
         'numpy', 'numba', 'scipy', 'matplotlib', 'pyarrow', 'rosbags', 'rich', 'jinja2', 'yaml'}
EVERY = [('servo_twin.cli', name) for name in OF_TWIN] + [
    ('servo_identify.cli', name)
    for name in (*OF_IDENTIFY, *added_commands('servo_identify.commands'))]


def loaded(program: str, *arguments: str) -> set[str]:
    """Return the packages that a program with these arguments has imported at its end."""
    code = (f'import sys; from {program} import main\n'
            'try: main(sys.argv[1:])\n'
            'except SystemExit: pass\n'
            'print("\\n" + " ".join({name.partition(".")[0] for name in sys.modules}))')
    done = subprocess.run([sys.executable, '-c', code, *arguments], capture_output=True, text=True,
                          check=True, timeout=120)
    return set(done.stdout.splitlines()[-1].split())


@pytest.mark.parametrize('program', ['servo_twin.cli', 'servo_identify.cli'])
@pytest.mark.parametrize('argument', ['--help', '--version'])
def test_the_overview_imports_no_numerics_at_all(program, argument):
    assert not loaded(program, argument) & HEAVY


@pytest.mark.parametrize(('program', 'command'), EVERY)
def test_the_help_of_a_command_imports_nothing_that_only_its_work_needs(program, command):
    assert not loaded(program, command, '--help') & HEAVY
