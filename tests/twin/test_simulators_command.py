"""The commands that read and write joints of simulators: they ..."""

from pathlib import Path
import re
import shlex
import shutil
import subprocess

import pytest

mujoco = pytest.importorskip('mujoco')

from servo_twin.cli import main  # noqa: E402
from servo_twin.description.servo_file import load  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = ROOT / 'config' / 'robots'


def run(*words):
    """Run servo-twin and return its exit status."""
    return main([str(word) for word in words])


def test_a_mjcf_joint_becomes_a_servo_file_that_says_where_each_value_is_from(tmp_path, capsys):
    out = tmp_path / 'shoulder.yaml'
    assert run('from-mjcf', ROBOTS / 'arm.xml', '--joint', 'shoulder', '--keyframe', 'home', '-o',
               out, '--noise', 'motor_position=2e-4', '--tolerance', '0.2') == 0
    servo = load(out)
    assert servo.values['controller.kp'] == 120.0
    assert "keyframe 'home'" in servo.provenance['mechanism.load_inertia'].source
    silent = [path for path in servo.values if path not in servo.provenance
              and not path.startswith('observer.')]
    assert silent == ['controller.filter', 'controller.on_load', 'effects.gravity.order']
    said = capsys.readouterr().out
    assert 'not in it: end stops' in said and 'No sensors' not in said
    assert f'next:    servo-identify check RECORDING --servo {out}\n' in said
    assert 'has the columns t, motor_position, reference_position at least' in said
    assert '# - end stops' in out.read_text()


@pytest.mark.parametrize(('command', 'robot'), [('from-urdf', 'arm.urdf'),
                                                ('from-mjcf', 'arm.xml')])
def test_all_joints_of_a_robot_get_a_servo_file_each(tmp_path, capsys, command, robot):
    folder = tmp_path / 'arm'
    words = (command, ROBOTS / robot, '-o', folder, '--joint')
    ratios = ('--ratio', 50, '--ratio', 'elbow=9')
    assert run(*words, 'all', '--at', 'elbow=0.3', *ratios) == 0
    ratio = {path.stem: load(path).values['mechanism.ratio'] for path in folder.glob('*.yaml')}
    assert ratio == {'shoulder': 50.0, 'elbow': 9.0, 'finger': 50.0}
    assert run(*words, 'shoulder,foot', '--force') == 1
    assert 'foot is left out' in capsys.readouterr().err
    for more, said in ((('all', '--ratio', 'hip=4'), "there is no joint 'hip' here"),
                       (('all', '--ratio', 'many'), "--ratio 'many': it must be a number"),
                       (('all', '-o', tmp_path / 's.yaml'), 'of several joints -o is a folder')):
        assert run(*words, *more) == 2
        assert said in capsys.readouterr().err


def test_a_urdf_joint_gets_its_gains_by_flags(tmp_path, capsys):
    out = tmp_path / 'elbow.yaml'
    assert run('from-urdf', ROBOTS / 'arm.urdf', '--joint', 'elbow', '--at', 'finger=0.01',
               '--kp', 30, '--kd', 1, '--armature', 0.005, '--torque-constant', 0.1, '-o',
               out) == 0
    servo = load(out)
    assert servo.values['mechanism.ratio'] == 9.0
    assert 'mechanicalReduction' in servo.provenance['mechanism.ratio'].source
    assert servo.values['mechanism.rotor_inertia'] == pytest.approx(0.005 / 81)
    assert servo.values['controller.command_torque'] == pytest.approx(0.9)
    assert 'No sensors' in capsys.readouterr().out


def test_what_is_exported_reads_back_by_the_command_that_stands_in_it(tmp_path, capsys,
                                                                      monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run('export', 'xl330', '--format', 'mjcf', '--joint', 'knee', '-o', 'knee.xml',
               '--duration', 2) == 0
    said = capsys.readouterr().out
    assert 'Error that this leaves' in said and f'MuJoCo {mujoco.__version__}' in said
    text = Path('knee.xml').read_text()
    for line in said.splitlines()[1:]:
        assert line.strip() in text
    again = re.search('name="read_back" data="(.*?)"', text)[1]
    assert run(*shlex.split(again)[1:]) == 0
    found, truth = load('knee.yaml'), load(ROOT / 'config' / 'servos' / 'xl330.yaml')
    for path in ('mechanism.rotor_inertia', 'mechanism.load_inertia', 'mechanism.ratio'):
        assert found.values[path] == pytest.approx(truth.values[path], rel=1e-9)
    assert found.values['effects.gravity.sine'] == pytest.approx(-0.4805, rel=1e-9)


@pytest.mark.parametrize('form', ['urdf', 'isaac'])
def test_the_other_formats_say_that_no_simulator_was_run(tmp_path, capsys, form):
    out = tmp_path / 'joint'
    assert run('export', 'xl330', '--format', form, '-o', out, '--duration', 2,
               '--velocity-limit', 6) == 0
    said = capsys.readouterr().out
    assert 'the simulator itself was not run' in said
    assert 'the simulator itself was not run' in out.read_text()


def test_without_mujoco_an_export_runs_the_equation(tmp_path, capsys, monkeypatch):
    import sys
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    assert run('export', 'xl330', '--format', 'mjcf', '-o', tmp_path / 'x.xml',
               '--duration', 2) == 0
    assert 'the simulator itself was not run' in capsys.readouterr().out


@pytest.mark.parametrize(('words', 'said'), [
    (['from-mjcf', 'gone.xml', '--joint', 'j', '-o', 'S'], 'gone.xml: there is no such file'),
    (['from-mjcf', 'ARM', '--joint', 'wrist', '-o', 'S'], "'shoulder', 'elbow', 'finger'"),
    (['from-mjcf', 'ARM', '--joint', 'elbow', '--at', 'finger', '-o', 'S'], 'NAME=VALUE'),
    (['from-mjcf', 'ARM', '--joint', 'elbow', '--noise', 'current=much', '-o', 'S'],
     'NAME=VALUE'),
    (['from-mjcf', 'ARM', '--joint', 'elbow', '-o', 'there.yaml'], '--force'),
    (['export', 'none', '--format', 'mjcf', '-o', 'S'], 'neither a file nor shipped'),
    (['export', 'xl330', '--format', 'urdf', '-o', 'S'], '--velocity-limit'),
    (['export', 'xl330', '--format', 'mjcf', '-o', 'there.yaml'], '--force'),
    (['export', 'xl330', '--format', 'mjcf', '--timestep', '0', '-o', 'S'], '--timestep 0'),
    (['export', 'xl330', '--format', 'mjcf', '--range', '1', '1', '-o', 'S'], '--range 1 1'),
    (['export', 'xl330', '--format', 'mjcf', '--duration', '1e9', '-o', 'S'], '10 to 1e+07'),
    (['export', 'xl330', '--format', 'mjcf', '--frequency', '1e6', '-o', 'S'], '--frequency'),
    (['from-urdf', 'URDF', '--joint', 'elbow', '--kp', 'nan', '-o', 'S'], '--kp nan'),
    (['from-urdf', 'URDF', '--joint', 'elbow', '--kp', '-5', '-o', 'S'], '--kp -5'),
    (['from-urdf', 'URDF', '--joint', 'elbow', '--torque-limit', 'nan', '-o', 'S'],
     '--torque-limit nan'),
    (['from-urdf', 'URDF', '--joint', 'elbow', '--gravity', 'nan', '-o', 'S'], '--gravity nan'),
    (['from-urdf', 'URDF', '--joint', 'elbow', '--at', 'finger=nan', '-o', 'S'], '--at finger'),
    (['export', 'feed_drive', '--format', 'mjcf', '-o', 'S'], 'loops of its own'),
])
def test_what_cannot_be_is_refused_before_anything_is_written(tmp_path, capsys, monkeypatch,
                                                              words, said):
    monkeypatch.chdir(tmp_path)
    Path('there.yaml').write_text('mine')
    try:
        status = run(*({'ARM': ROBOTS / 'arm.xml', 'URDF': ROBOTS / 'arm.urdf'}.get(word, word)
                       for word in words))
    except SystemExit as end:  # what argparse itself refuses
        status = end.code
    assert status == 2
    assert said in capsys.readouterr().err
    assert Path('there.yaml').read_text() == 'mine' and not Path('S').exists()


def test_force_writes_over_a_file(tmp_path):
    out = tmp_path / 'there.yaml'
    out.write_text('mine')
    assert run('from-mjcf', ROBOTS / 'arm.xml', '--joint', 'elbow', '-o', out, '--force') == 0
    assert load(out).name == 'arm_elbow'


def examples():
    """Return the command blocks of the page that are to be run."""
    page = (ROOT / 'docs' / 'simulators.md').read_text()
    return re.findall(r'```sh\n(.*?)```', page, re.DOTALL)


def test_the_page_has_examples():
    assert len(examples()) >= 3


@pytest.mark.long
@pytest.mark.slow
def test_the_examples_of_the_page_run_as_they_stand(tmp_path):
    shutil.copytree(ROOT / 'config', tmp_path / 'config')
    script = 'set -e\n' + '\n'.join(examples())
    ended = subprocess.run(['bash', '-c', script], cwd=tmp_path, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stdout + ended.stderr
