"""`pip install` of the packages, without ROS: the front door opens and the commands answer."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
FRONT_DOOR = """
import servo_identify as si
servo = si.load_servo('my.yaml'); data = si.read('run*', servo)
checked = si.check(data, servo); fit = si.fit(data[:1], servo, ['effects.load_viscous.slope'])
answer = si.diagnose(data, servo)
print(answer)
answer.augmented.save('my_augmented.yaml'); answer.plot('curve')
"""


@pytest.fixture(scope='module')
def installed(tmp_path_factory):
    """Return (site, the environment of a shell without ROS) after `pip install`."""
    folder = tmp_path_factory.mktemp('pip')
    for name in ('src', 'config'):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns(
            '__pycache__', '*.egg-info', 'build'))
    site = folder / 'site'
    subprocess.run(
        [sys.executable, '-m', 'pip', 'install', '--quiet', '--no-deps', '--no-build-isolation',
         '--no-index', '--target', site, folder / 'src/servo_twin', folder / 'src/servo_identify'],
        check=True, timeout=200)
    kept = {name: os.environ[name] for name in ('HOME', 'NUMBA_CACHE_DIR') if name in os.environ}
    return site, kept | {'PYTHONPATH': str(site), 'PATH': f'{site}/bin:/usr/bin:/bin'}


@pytest.mark.long
@pytest.mark.slow
def test_the_front_door_opens_on_recordings_of_ones_own(installed, tmp_path):
    _, shell = installed
    shutil.copy(ROOT / 'docs/example/fan.yaml', tmp_path / 'my.yaml')
    for run in (ROOT / 'docs/example/runs').glob('*_[12].csv'):
        shutil.copy(run, tmp_path / f'run_{run.name}')
    told = subprocess.run([sys.executable, '-c', FRONT_DOOR], cwd=tmp_path, env=shell,
                          capture_output=True, text=True, timeout=280)
    assert told.returncode == 0, told.stderr
    assert 'quadratic drag at the load shaft' in told.stdout
    assert 'quadratic_drag' in (tmp_path / 'my_augmented.yaml').read_text()


@pytest.mark.slow
@pytest.mark.parametrize('command', ['servo-twin', 'servo-identify'])
def test_the_commands_are_there(installed, command):
    site, shell = installed
    told = subprocess.run([sys.executable, site / 'bin' / command, '--version'], env=shell,
                          capture_output=True, text=True, timeout=60)
    assert told.stdout.startswith(command), told.stderr
