"""Input that nobody meant ends in an answer or in a sentence; `make fuzz` tries longer."""

import json
from pathlib import Path
import subprocess
import sys

from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
import pytest
import yaml

from servo_identify.data.mapping import read_mapping
from servo_identify.data.table_import import import_table
from servo_twin.description.servo_file import loads
from servo_twin.physics.servo import ServoError

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'fuzz'))
from targets import cases, TARGETS
from trial import judge, tried

FOUND = list(cases(Path(__file__).parent / 'fuzz_cases'))
CONFIG = Path(__file__).resolve().parents[2] / 'config'
SERVO = CONFIG / 'servos' / 'dc_gearmotor.yaml'
SERVOS = [yaml.safe_load(one.read_text()) for one in sorted((CONFIG / 'servos').glob('*.yaml'))]
MAPPINGS = [yaml.safe_load(one.read_text()) for one in sorted((CONFIG / 'imports').glob('*'))]
SHORT = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
ODD = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.dates(),
    st.sampled_from(['source', 'value', 't', 'load', 1e308, -0.0, '10 %', 'N m', b'x']),
    st.lists(st.floats(), max_size=3), st.dictionaries(st.text(max_size=3), st.floats(),
                                                       max_size=2))


@st.composite
def spoilt(draw, trees):
    """A tree of a good file with some of it replaced, removed or added."""
    tree = yaml.safe_load(yaml.safe_dump(draw(st.sampled_from(trees))))
    for _ in range(draw(st.integers(1, 4))):
        at = tree
        while isinstance(at, dict) and at:
            key = draw(st.sampled_from(sorted(at, key=str)))
            if not isinstance(at[key], dict) or not at[key] or draw(st.integers(0, 3)) == 0:
                break
            at = at[key]
        if not isinstance(at, dict) or not at:
            continue
        match draw(st.sampled_from(['replace', 'remove', 'add'])):
            case 'replace':
                at[key] = draw(ODD)
            case 'remove':
                del at[key]
            case 'add':
                at[draw(st.one_of(st.text(max_size=5), st.integers()))] = draw(ODD)
    return yaml.safe_dump(tree)


@pytest.mark.long
@SHORT
@given(text=spoilt(SERVOS))
def test_a_spoilt_servo_file_loads_or_is_refused(text):
    try:
        loads(text)
    except ServoError as refusal:
        assert str(refusal)


@SHORT
@given(text=st.one_of(spoilt(MAPPINGS), st.text(max_size=60)))
def test_a_spoilt_mapping_loads_or_is_refused(tmp_path, text):
    path = tmp_path / 'mapping.yaml'
    path.write_text(text, 'utf8')
    try:
        read_mapping(path)
    except ValueError as refusal:
        assert 'mapping.yaml' in str(refusal)


CELL = st.one_of(st.floats().map(repr), st.integers(-9, 9).map(str),
                 st.sampled_from(['', 'nan', '1,5', '"', ' ', 'x', '1e400', '#', '\x00']))
HEADER = st.lists(st.sampled_from(['t', 't [ms]', 'voltage', 'motor_position', 'u', 'time',
                                   'load_position [deg]', '', '1', 'current [mH]']), max_size=5)


@SHORT
@given(header=HEADER, rows=st.lists(st.lists(CELL, max_size=5), max_size=6),
       between=st.sampled_from([',', ';', '\t']))
def test_a_spoilt_table_is_read_or_refused(tmp_path, header, rows, between):
    path = tmp_path / 'table.csv'
    path.write_text('\n'.join(between.join(row) for row in [header, *rows]), 'utf8')
    try:
        import_table(path, SERVO)
    except ValueError as refusal:
        assert 'table' in str(refusal)


@pytest.mark.parametrize('program', ['servo_twin', 'servo_identify'])
def test_each_command_says_its_version(program, capsys):
    from importlib import import_module
    assert import_module(f'{program}.cli').main(['--version']) == 0
    name, number = capsys.readouterr().out.split()
    assert name == program.replace('_', '-') and number[0].isdigit()


@pytest.mark.parametrize(('name', 'case'), FOUND, ids=[f'{n}-{c.name}' for n, c in FOUND])
def test_what_was_found_before_is_answered_or_refused(name, case, tmp_path):
    folder = tmp_path / 'box' / 'work'
    folder.mkdir(parents=True)
    TARGETS[name].seeds(folder)
    outcome, said = judge(TARGETS[name], case.read_bytes(), folder)
    assert outcome in ('answered', 'refused'), said


@pytest.mark.parametrize('name', sorted(TARGETS))
def test_spoilt_input_ends_in_an_answer_or_a_sentence(name, tmp_path):
    trials = tried(TARGETS[name], f'house {name}', tmp_path / 'box' / 'work', 10.0, most=12)
    assert trials.inputs and not trials.findings, [said for _, said in trials.findings.values()]


def test_each_family_of_inputs_has_the_same_time():
    from targets import FAMILIES, seconds_of
    seconds = seconds_of(list(TARGETS), 60.0)
    assert set(seconds) == {name for members in FAMILIES.values() for name in members}
    for members in FAMILIES.values():
        assert sum(seconds[name] for name in members) == pytest.approx(60.0 / len(FAMILIES))
    assert seconds_of(['sdo', 'csv'], 8.0) == {'sdo': 4.0, 'csv': 4.0}


def test_a_run_says_its_inputs_by_family_and_the_lines_of_each_parser(tmp_path):
    fuzz = Path(__file__).resolve().parents[1] / 'fuzz' / 'fuzz.py'
    ran = subprocess.run(
        [sys.executable, fuzz, '--coverage', '--seconds', '2', '--only', 'packet', 'sdo', '--jobs',
         '1', '--keep', tmp_path / 'found'], capture_output=True, text=True, timeout=120,
        check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    words = [line.split() for line in ran.stdout.splitlines() if line]
    assert int(next(line[1] for line in words if line[0] == 'bus')) > 100
    share = {line[0]: int(line[2]) for line in words if line[0].startswith('servo_')}
    assert share['servo_rig_driver.can_bus.unix_frames'] > 40
    assert share['servo_rig_driver.emulated.object_server'] > 40


def test_coverage_guides_the_spoiling_where_atheris_is_there(tmp_path):
    pytest.importorskip('atheris', reason='make fuzz GUIDED=1 fetches it')
    fuzz = Path(__file__).resolve().parents[1] / 'fuzz' / 'fuzz.py'
    ran = subprocess.run(
        [sys.executable, fuzz, '--guided', '--seconds', '3', '--only', 'packet', '--keep',
         tmp_path / 'found', '--json', tmp_path / 'counts.json'],
        capture_output=True, text=True, timeout=120, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    told, = json.loads((tmp_path / 'counts.json').read_text())
    assert told['inputs'] > 100 and told['answered'] and told['refused']


def test_the_judge_sees_what_is_no_sentence(tmp_path):
    from target import Target

    def taking(problem):
        def take(content, folder):
            raise problem
        return Target('planted', True, lambda folder: [b'x'], take, ())

    folder = tmp_path / 'box' / 'work'
    folder.mkdir(parents=True)
    assert judge(taking(KeyError('x')), b'', folder)[0] == 'finding'
    assert judge(taking(ValueError('')), b'', folder)[0] == 'finding'
    assert judge(taking(ValueError('a.csv is no table')), b'', folder)[0] == 'refused'

    def outside(content, folder):
        (folder.parent / 'slip').write_bytes(content)
    said = judge(Target('planted', True, lambda folder: [b'x'], outside, ()), b'x', folder)
    assert said == ('finding', 'made slip outside of its folder')


def test_no_archive_of_an_fmu_writes_outside_of_its_folder(tmp_path, monkeypatch):
    import zipfile

    from servo_twin.fmu.fmu_file import FmuError, opened
    monkeypatch.setenv('SERVO_TWIN_CACHE', str(tmp_path / 'cache'))
    for name in ('../slip', '/slip', 'a/../../slip', '..\\slip'):
        path = tmp_path / 'one.fmu'
        with zipfile.ZipFile(path, 'w') as archive:
            archive.writestr('modelDescription.xml', '<fmiModelDescription/>')
            archive.writestr(name, 'x')
        with pytest.raises(FmuError, match='outside of its folder'):
            opened(path)
