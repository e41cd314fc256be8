"""`import servo_identify as si`: from files or arrays to an answer, without deep imports."""

from dataclasses import FrozenInstanceError, replace
from importlib import import_module
from inspect import getdoc, signature
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
import re
import subprocess
import sys

import numpy as np
import pytest
from synthetic_recordings import PERIOD, sampled

import servo_identify as si
from servo_twin.bag import write_recording
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

BENCH = si.load_servo('rv_bench')
WHOLE = BENCH.servo
MISSING = WHOLE.with_effects(Placed('e', find('gravity'), 'load'), values={
    'effects.e.cosine': 40.0})


def recorded(rig, seed, seconds=6.0):
    """Return a recording of a rig, moved by several sines."""
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    command = sum(1.1 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.5, 1.3, 3.1))
    return replace(sampled(rig, command, seed=seed), name=f'multisine_{seed}', family='multisine',
                   servo=rig.name)


@pytest.fixture(scope='module')
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp('bags')
    for seed in (1, 2, 3):
        write_recording(folder / f'run_{seed}', recorded(MISSING, seed))
    return si.read(str(folder / 'run_*'), BENCH)


@pytest.fixture(scope='module')
def snippet(data, tmp_path_factory):
    """Run the first snippet of its page as it stands; return its folder and its names."""
    page = (Path(__file__).resolve().parents[2] / 'docs' / 'python.md').read_text()
    text = re.search(r'```python\n(.*?)```', page, re.DOTALL)[1]
    folder, names = tmp_path_factory.mktemp('snippet'), {}
    BENCH.save(folder / 'my.yaml')
    for one in data:
        write_recording(folder / one.name, one)
        (bag,) = (folder / one.name).glob('*.mcap')
        bag.rename(folder / f'{one.name}.mcap')
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        exec(compile(text, 'docs/python.md', 'exec'), names)
    return folder, names


@pytest.fixture(scope='module')
def answer(snippet):
    return snippet[1]['answer']


def test_importing_it_loads_neither_numpy_nor_ros():
    program = ('import sys, servo_identify\n'
               'print(*(m for m in ("numpy", "numba", "rclpy", "jinja2") if m in sys.modules))')
    said = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                          check=True)
    assert said.stdout.split() == []


def test_one_recording_and_a_wrong_family_say_what_there_is(data):
    assert repr(data[0]) == ('Recording run_1, family multisine: 6 s at 1000 Hz, voltage, '
                             'current, motor_position, load_position, torque, external_torque')
    with pytest.raises(ValueError, match="family 'multi_sine'; did you mean 'multisine'"):
        data.of_family('multi_sine')


def test_it_says_its_version_and_its_names():
    assert si.__version__[0].isdigit()
    assert {'load_servo', 'read', 'check', 'fit', 'diagnose'} <= set(dir(si))
    with pytest.raises(AttributeError, match="has no 'diagnosis'.*load_servo"):
        si.diagnosis()


def test_its_page_names_what_there_is():
    page = (Path(__file__).resolve().parents[2] / 'docs' / 'python.md').read_text()
    named = set(re.findall(r'\bsi\.(\w+)', page))
    assert named == {'load_servo', 'read', 'check', 'fit', 'diagnose'}
    kinds = '(ServoFile|Recordings|Checked|Fitted|Answer)'
    for kind, members in re.findall(rf'`{kinds}`: (.*?) \|', page):
        known = set(dir(getattr(si, kind))) | set(getattr(si, kind).__dataclass_fields__)
        assert set(re.findall(r'`(\w+)', members)) <= known


def test_fit_and_diagnose_are_functions_and_stay_packages():
    for name in ('servo_identify.diagnose.diagnose', 'servo_identify.fit.estimate'):
        import_module(name)
    assert callable(si.fit) and callable(si.diagnose)
    assert si.fit.estimate is sys.modules['servo_identify.fit.estimate']
    assert si.diagnose.diagnose is sys.modules['servo_identify.diagnose.diagnose']


@pytest.mark.parametrize('call', ['load_servo', 'read', 'check', 'fit', 'diagnose'])
def test_each_call_says_its_arguments_and_what_it_raises(call):
    said = getdoc(getattr(si, call))
    assert re.search(r'[Rr]aises .*Error', said), said
    assert 'data' in signature(getattr(si, call)).parameters or call in ('load_servo', 'read')


def test_help_of_fit_is_that_of_the_call_and_not_of_the_package():
    assert getdoc(si.fit).startswith('fit(data: ') and 'standard error' in getdoc(si.fit)
    assert 'accept' in getdoc(si.diagnose)


def test_a_shipped_servo_and_a_file_are_read_alike(tmp_path):
    path = BENCH.save(tmp_path / 'mine.yaml')
    again = si.load_servo(path)
    assert again.servo == BENCH.servo and again.text == BENCH.text
    assert 'rv_bench' in repr(again) and str(again) == BENCH.text
    with pytest.raises(ValueError, match='shipped'):
        si.load_servo('rv_bensch')


def test_results_are_frozen(data):
    with pytest.raises(FrozenInstanceError):
        data.items = ()
    with pytest.raises(FrozenInstanceError):
        BENCH.text = ''


def test_recordings_are_a_sequence_that_prints_what_it_holds(data):
    assert len(data) == 3 and [one.name for one in data[1:]] == ['run_2', 'run_3']
    assert 'multisine' in repr(data) and '<td>run_1</td>' in data._repr_html_()
    assert len(data.of_family('multisine')) == 3 and len(data + data) == 6


def test_a_recording_that_there_is_not_is_refused_in_a_sentence(data):
    for take in (lambda: data[3], lambda: data.table(3), lambda: data[-4]):
        with pytest.raises(IndexError, match='there are 3, counted from 0'):
            take()
    with pytest.raises(TypeError, match=r"as in data\[0\]\['current'\]"):
        data['current']
    with pytest.raises(KeyError, match="run_1 has no column 'curent'; there are .*'current'"):
        data[0]['curent']


@pytest.mark.parametrize(('package', 'call'), [
    ('pandas', 'data.frame'), ('xarray', 'data.dataset')])
def test_a_package_that_is_not_there_is_named_with_how_to_get_it(data, monkeypatch, package, call):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ImportError, match=f'{call} needs {package}: `pip install {package}`'):
        getattr(data, call.partition('.')[2])(0)


@pytest.mark.parametrize('held', [np.zeros((5, 3)), None, [np.zeros(3)]])
def test_it_says_what_it_reads_where_something_else_is_given(held):
    with pytest.raises(TypeError, match='read takes names of files, or columns by name'):
        si.read(held, BENCH)


def test_columns_that_were_not_read_and_exchanged_arguments_are_refused_in_a_sentence(data):
    for call in (si.check, si.fit, si.diagnose):
        with pytest.raises(TypeError, match='data = si.read'):
            call({'t': np.arange(9.0)}, BENCH)
    with pytest.raises(TypeError, match='data is ServoFile, not recordings'):
        si.check(BENCH, data)
    with pytest.raises(TypeError, match='this is Recordings'):
        si.check(data, data)


@pytest.mark.parametrize(('call', 'words'), [
    (lambda data: si.load_servo(None), 'this is NoneType'),
    (lambda data: si.read(data.table(0), BENCH, mapping={'t': 'x'}), 'mapping is dict'),
    (lambda data: si.read(data.table(0), BENCH, family=3), 'family is int, it must be a text'),
    (lambda data: si.fit(data, BENCH, 'drive.gain'), r"free=\['drive.gain'\]"),
    (lambda data: si.fit(data, BENCH, channels='current'), r"channels=\['current'\]"),
    (lambda data: si.diagnose(data, BENCH, without='gravity'), r"without=\['gravity'\]")])
def test_an_argument_of_another_kind_is_refused_in_a_sentence(data, call, words):
    with pytest.raises(TypeError, match=words):
        call(data)


@pytest.mark.parametrize(('reach', 'words'), [
    ({'height': 2.0}, "no reach 'height'"), ({'travel': -2.0}, 'travel = -2 rad, it must be')])
def test_a_reach_that_is_none_is_refused(data, reach, words):
    with pytest.raises(ValueError, match=words):
        si.diagnose(data, BENCH, reach=reach)


def test_a_recording_is_given_out_as_columns_and_read_back(data):
    table = data.table(1)
    (again,) = si.read(table, BENCH)
    assert set(table) >= {'t', 'voltage', 'load_position'}
    assert again['load_position'] == pytest.approx(data[1]['load_position'])


@pytest.mark.long
def test_it_reads_checks_and_writes_without_ros_and_without_what_is_extra(data, tmp_path):
    missing = ['rclpy', 'ament_index_python', 'servo_twin_msgs', 'torch', 'pysindy', 'control',
               'matplotlib', 'distributed', 'dask', 'fmpy', 'mujoco', 'sklearn']
    write_recording(tmp_path / 'bag', data[0])
    path = BENCH.save(tmp_path / 'servo.yaml')
    program = f"""
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[0] in {missing}:
            raise ModuleNotFoundError(f'no module named {{name}}', name=name)
sys.meta_path.insert(0, Absent())
import servo_identify as si
servo = si.load_servo({str(path)!r})
print(si.check(si.read({str(tmp_path / 'bag')!r}, servo), servo))
import servo_identify.diagnose.diagnose
"""
    said = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    assert 'green' in said.stdout


@pytest.mark.parametrize('way', ['frame', 'dataset'])
def test_a_recording_goes_out_to_pandas_and_xarray_and_comes_back(data, way):
    pytest.importorskip('pandas')
    pytest.importorskip('xarray')
    held = getattr(data, way)(1)
    (again,) = si.read(held, BENCH, name='again')
    assert again.period == pytest.approx(data[1].period)
    for name in ('voltage', 'motor_position', 'load_position'):
        assert again[name] == pytest.approx(data[1][name])


@pytest.mark.long
@pytest.mark.slow
def test_the_first_snippet_of_its_page_runs_as_it_stands(snippet):
    assert (snippet[0] / 'my_augmented.yaml').is_file()


def test_a_check_is_true_where_nothing_is_red(data):
    found = si.check(data, BENCH)
    assert found and 'green' in repr(found)
    wrong = [replace(one, columns={**one.columns, 'load_position': -one['load_position']})
             for one in data]
    assert not si.check(wrong, BENCH) and 'runs against' in repr(si.check(wrong, BENCH))


def test_a_fit_prints_its_values_and_gives_a_servo_file_with_comments(data, tmp_path):
    path = 'effects.coulomb.level'
    found = si.fit(data[:1], BENCH, [path])
    assert list(found.values) == [path] and path in repr(found) and path in found._repr_html_()
    assert re.search(r'load_position: residual \S+ -> \S+ rad, noise \S+ rad', repr(found))
    again = servo_file.load(found.servo.save(tmp_path / 'fitted.yaml'))
    assert again.values[path] == pytest.approx(found.values[path], rel=1e-5)
    assert found.std[path] > 0.0
    assert sum('#' in line for line in found.servo.text.splitlines()) >= sum(
        '#' in line for line in BENCH.text.splitlines()) > 0


def test_a_fit_stops_at_what_the_check_finds_red_or_goes_on_and_says_it(data):
    path = 'effects.coulomb.level'
    assert not any('To do' in one for one in si.fit(data[:1], BENCH, [path]).estimate.warnings)
    wrong = [replace(one, columns={**one.columns, 'load_position': -one['load_position']})
             for one in data[:1]]
    with pytest.raises(ValueError, match=r'(?s)runs against.*negate: true.*despite_check=True'):
        si.fit(wrong, BENCH, [path])
    first = si.fit(wrong, BENCH, [path], despite_check=True).estimate.warnings[0]
    assert 'runs against' in first and 'negate: true' in first


@pytest.mark.slow
def test_an_answer_prints_its_sentence_and_is_a_page_in_a_notebook(answer):
    assert repr(answer) == answer.sentence == answer.report.verdict['sentence']
    assert answer.page.lstrip().startswith('<!')
    assert answer._repr_html_().startswith('<iframe srcdoc=')


@pytest.mark.slow
def test_the_augmented_servo_has_what_was_missing(answer, tmp_path):
    assert answer.effects == ('gravity',)
    again = servo_file.load(answer.augmented.save(tmp_path / 'augmented.yaml'))
    assert set(again.values) > set(WHOLE.values)
    folder = answer.save(tmp_path / 'answer')
    assert sorted(one.name for one in folder.iterdir()) == [
        'augmented.yaml', 'report.html', 'report.json']


@pytest.mark.slow
def test_the_curve_of_an_effect_is_drawn(answer):
    figure = answer.plot('curve')
    assert figure.axes[0].get_title() == 'gravity'
    assert figure._repr_png_().startswith(b'\x89PNG')  # what a notebook shows
    with pytest.raises(ValueError, match="with one are \\['gravity'\\]"):
        answer.plot('curve', 'cogging')
    with pytest.raises(ValueError, match="there is 'curve'"):
        answer.plot('surface')


def test_an_answer_comes_whole_out_of_another_process(answer, tmp_path):
    back = ForkingPickler.loads(ForkingPickler.dumps(answer))  # as a pool of processes does
    assert repr(back) == repr(answer) and back.page == answer.page
    assert back.effects == answer.effects and back.plot().axes
    assert (back.save(tmp_path) / 'augmented.yaml').read_text() == answer.augmented.text
