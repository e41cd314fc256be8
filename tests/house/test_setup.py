"""The set-up: what it says where something is missing, and when it does nothing."""

import json
import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parents[2]
TOOLS = ROOT / 'tools'
sys.path.insert(0, str(TOOLS))

import fingerprints  # noqa: E402
import machine  # noqa: E402
import setup_workspace  # noqa: E402
import stages  # noqa: E402


@pytest.fixture
def bare(tmp_path):
    """A copy of what the set-up reads, and a PATH folder with nothing on it but the shell."""
    root = tmp_path / 'workspace'
    for name in ('tools', 'requirements'):
        shutil.copytree(ROOT / name, root / name)
    (root / 'src').mkdir()
    shutil.copy(ROOT / 'env.sh', root)
    path = tmp_path / 'bin'
    path.mkdir()
    for name in ('sh', 'dirname'):
        (path / name).symlink_to(shutil.which(name))
    return root, path


def _set_up(root, path, **variables):
    return subprocess.run(['sh', root / 'tools' / 'setup.sh'], capture_output=True, text=True,
                          env={'PATH': str(path)} | variables, check=False)


def _sentence(answer) -> str:
    assert answer.returncode == 1
    assert answer.stdout == ''
    (line,) = answer.stderr.splitlines()
    return line


def test_it_says_in_one_sentence_that_python_is_missing(bare):
    assert 'no Python 3.11 or 3.12 runs here' in _sentence(_set_up(*bare))


def test_it_passes_over_a_python_that_does_not_run(bare):
    root, path = bare
    shim = path / 'python3.12'
    shim.write_text('#!/bin/sh\necho "command not found" >&2\nexit 127\n')
    shim.chmod(0o755)
    (path / 'python3').symlink_to(sys.executable)
    assert 'no C++ compiler runs here' in _sentence(_set_up(root, path))


def test_it_says_that_the_named_python_does_not_run(bare):
    assert 'PYTHON=/nowhere/python' in _sentence(_set_up(*bare, PYTHON='/nowhere/python'))


def test_it_says_in_one_sentence_that_the_compiler_is_missing(bare):
    root, path = bare
    answer = _set_up(root, path, PYTHON=sys.executable)
    assert 'no C++ compiler runs here' in _sentence(answer)
    assert not (root / '.venv').exists()


def test_it_names_the_compiler_that_was_asked_for(bare):
    answer = _set_up(*bare, PYTHON=sys.executable, CXX='no-such-compiler')
    assert 'no-such-compiler' in _sentence(answer)


def test_it_refuses_another_python():
    with pytest.raises(machine.SetupError, match='Python 3.13 is not one of 3.11 and 3.12'):
        machine.require_python((3, 13))


def test_it_says_that_the_headers_are_missing(monkeypatch, tmp_path):
    monkeypatch.setattr(machine.sysconfig, 'get_paths', lambda: {'include': str(tmp_path)})
    with pytest.raises(machine.SetupError, match='Python.h is missing'):
        machine.require_headers()


def test_it_refuses_another_sourced_distribution(monkeypatch):
    monkeypatch.setenv('ROS_DISTRO', 'humble')
    monkeypatch.setenv('AMENT_PREFIX_PATH', '/opt/ros/humble')
    with pytest.raises(machine.SetupError, match='ROS 2 humble is sourced'):
        machine.sourced_ros()


class _Recorded:
    """A workspace whose stages only note that they ran."""

    def __init__(self, root):
        self.root = root
        self.ran = []

    def make_environment(self):
        (self.root / '.venv').mkdir(exist_ok=True)
        self.ran.append('environment')

    def install_packages(self):
        self.ran.append('packages')

    def install_training(self):
        self.ran.append('training')
        return False

    def build(self):
        self.ran.append('build')


@pytest.fixture
def recorded(bare):
    """Bring the bare workspace up with recorded stages; returns what ran."""
    root, _ = bare

    def bring_up(training=False):
        workspace = _Recorded(root)
        wanted = setup_workspace.wanted_stamp(root, False, training)
        setup_workspace.bring_up(root, workspace, wanted)
        return workspace.ran
    return root, bring_up


def test_it_does_nothing_the_second_time(recorded):
    _, bring_up = recorded
    assert bring_up() == ['environment', 'packages', 'build']
    assert bring_up() == []


def test_it_fetches_what_only_training_needs_when_asked_and_once(recorded):
    root, bring_up = recorded
    assert bring_up(training=True) == ['environment', 'packages', 'build', 'training']
    assert bring_up(training=True) == bring_up() == []
    (root / 'requirements' / 'workspace.txt').write_text('numpy\n')
    assert bring_up() == ['packages', 'build']
    assert bring_up(training=True) == ['training']


def test_it_installs_and_builds_again_when_a_requirement_changes(recorded):
    root, bring_up = recorded
    bring_up()
    (root / 'requirements' / 'workspace.txt').write_text('numpy\n')
    assert bring_up() == ['packages', 'build']


@pytest.mark.parametrize('source', [
    'src/servo_twin_msgs/msg/Encoder.msg', 'src/servo_twin/setup.py', 'config/servos/new.yaml',
    'src/servo_twin/launch/twin.launch.yaml'])
def test_it_only_builds_again_when_a_built_source_appears(recorded, source):
    root, bring_up = recorded
    bring_up()
    (root / source).parent.mkdir(parents=True)
    (root / source).write_text('x')
    assert bring_up() == ['build']


def test_it_leaves_edits_of_python_files_alone(recorded):
    root, bring_up = recorded
    module = root / 'src' / 'servo_twin' / 'servo_twin' / 'law.py'
    module.parent.mkdir(parents=True)
    module.write_text('a = 1\n')
    bring_up()
    module.write_text('a = 2\n')
    assert bring_up() == []


def test_it_goes_on_after_a_stage_that_failed(recorded, monkeypatch):
    root, bring_up = recorded

    def fail(self):
        raise machine.StageError('pip could not')
    with monkeypatch.context() as patched, pytest.raises(machine.StageError):
        patched.setattr(_Recorded, 'install_packages', fail)
        bring_up()
    assert bring_up() == ['packages', 'build']


@pytest.mark.parametrize('text', ['', 'first', '[]'])
def test_it_takes_a_broken_stamp_for_none(bare, text):
    root, _ = bare
    (root / '.venv').mkdir()
    (root / fingerprints.STAMP).write_text(text)
    assert fingerprints.read_stamp(root) == {}


def test_it_points_the_wheels_cmake_files_at_this_machine(tmp_path):
    exported = tmp_path / 'export.cmake'
    python = '/opt/python/cp312-cp312'
    exported.write_text(f'set(a "{python}/include/python3.12;'
                        f'{python}/lib/python3.12/site-packages/numpy/_core/include")')
    assert stages.repair_cmake_files(tmp_path, '/here/numpy') == 1
    include = stages.sysconfig.get_paths()['include']
    assert exported.read_text() == f'set(a "{include};/here/numpy")'
    assert stages.repair_cmake_files(tmp_path, '/here/numpy') == 0


def test_it_says_in_a_shell_that_the_workspace_is_not_set_up(bare):
    root, _ = bare
    answer = subprocess.run(['bash', '-c', f'. {root}/env.sh'], capture_output=True, text=True,
                            check=False)
    assert 'is not set up yet' in _sentence(answer)


@pytest.mark.parametrize('shell', ['bash', 'sh'])
def test_it_puts_the_commands_on_the_path(shell, tmp_path):
    if not fingerprints.read_stamp(ROOT):
        pytest.skip('this workspace is not set up')
    # bash finds the workspace from anywhere, sh from its root.
    folder = tmp_path if shell == 'bash' else ROOT
    program = (f'. {ROOT}/env.sh && . {ROOT}/env.sh && command -v servo-twin servo-identify '
               'driver && python -c "import servo_twin, rclpy, servo_twin_msgs.msg" && '
               'printf %s "$PYTHONPATH"')
    kept = {'HOME', 'LANG'}
    if machine.sourced_ros():
        kept |= {'ROS_DISTRO', 'AMENT_PREFIX_PATH', 'PYTHONPATH', 'LD_LIBRARY_PATH'}
    variables = {name: os.environ[name] for name in kept & os.environ.keys()}
    answer = subprocess.run([shell, '-c', program], cwd=folder, capture_output=True, text=True,
                            env=variables | {'PATH': '/usr/bin:/bin'}, check=False)
    assert answer.returncode == 0, answer.stderr
    places = answer.stdout.splitlines()[-1].split(os.pathsep)
    assert len(places) == len(set(places))


def test_it_registers_the_bus_with_python_can():
    if not fingerprints.read_stamp(ROOT):
        pytest.skip('this workspace is not set up')
    program = ('from importlib.metadata import entry_points; '
               'print([e.value for e in entry_points(group="can.interface", name="unix_bus")])')
    answer = subprocess.run(['bash', '-c', f". {ROOT}/env.sh && python -c '{program}'"],
                            capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == str(['servo_rig_driver.can_bus.unix_bus:UnixBus'])


def test_it_writes_the_stamp_in_one_move(tmp_path):
    (tmp_path / '.venv').mkdir()
    fingerprints.write_stamp(tmp_path, {'build': 'a'})
    assert json.loads((tmp_path / fingerprints.STAMP).read_text()) == {'build': 'a'}
    assert [path.name for path in (tmp_path / '.venv').iterdir()] == ['workspace.stamp']
