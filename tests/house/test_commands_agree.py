"""One way of naming data and servo files, in all commands: each command ..."""

import json
from pathlib import Path
import signal
import subprocess
import sys
from urllib.request import urlopen

import numpy as np
import pytest

from servo_identify.cli import COMMANDS as IDENTIFY
from servo_identify.cli import main as identify
from servo_identify.data.reading import read_recordings
from servo_twin.bag import write_recording
from servo_twin.cli import _parser, added_commands
from servo_twin.cli import COMMANDS as TWIN
from servo_twin.cli import main as twin

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / 'docs' / 'example' / 'runs' / 'slow_reversals_1.csv'
SERVO = ROOT / 'docs' / 'example' / 'fan.yaml'
KINDS = ('table', 'bag', 'mcap', 'pattern')
PROGRAMS = {'servo-identify': (identify, IDENTIFY | added_commands('servo_identify.commands')),
             'servo-twin': (twin, TWIN)}


def actions_of(program, command):
    """Return what a command declares, by its options and the names of its arguments."""
    _, commands = PROGRAMS[program]
    package = 'servo_identify' if program == 'servo-identify' else 'servo_twin'
    parser = _parser(program, command, commands, package)[1]
    return parser, {name: action for action in parser._actions
                    for name in (action.option_strings or [action.dest])}


EVERY = [(program, command) for program, (_, commands) in PROGRAMS.items() for command in commands]
SERVING = ('run', 'view')
"""Commands that read a recording, but are for rigs: they start processes, or serve until ended."""
READING = [(program, command) for program, command in EVERY if command not in SERVING
           and {'bag', 'bags'} & set(actions_of(program, command)[1])]
ALSO = {'harmonic-drives': ['--held-out', str(TABLE)], 'play': ['--settings', '0.0']}
"""What a command needs beside data, servo and output."""
WRITTEN = ('report.json', 'online.csv', 'table.md', 'linear.json')
"""A file of each command that writes a folder."""


ROBOT = ROOT / 'config' / 'robots' / 'arm.urdf'
MACHINE = ['--drive', 'voltage', '--mechanism', 'rigid', '--gain', '1', '--resistance', '2.2 ohm',
           '--inductance', '0.8 mH', '--back-emf', '0.02 V s/rad', '--torque-constant',
           '0.02 N m/A', '--rotor-inertia', '20 g cm2', '--load-inertia', '4e-3 kg m2', '--ratio',
           '30']
RUNS = {
    'init': [str(TABLE), '-o', 'OUT/new.yaml', '--si', '--no-questions', *MACHINE],
    'schema': ['servo'],
    'import': [str(TABLE), '--servo', str(SERVO), '-o', 'OUT/bag'],
    'info': [str(TABLE)],
    'check': [str(TABLE), '--servo', str(SERVO)],
    'experiment': ['hold', '--duration', '0.2', '--headless', '-o', 'OUT'],
    'sinusoid': [str(TABLE)],
    'online': [str(TABLE), '--servo', str(SERVO), '-o', 'OUT'],
    'replay': [str(TABLE), '--servo', str(SERVO), '-o', 'OUT/bag'],
    'linearise': [str(SERVO), '-o', 'OUT'],
    'from-urdf': [str(ROBOT), '--joint', 'elbow', '--at', 'finger=0.01', '-o', 'OUT/new.yaml'],
    'export': [str(SERVO), '--format', 'urdf', '--velocity-limit', '9', '-o', 'OUT/new.urdf',
               '--duration', '1'],
    'parameters': ['gravity'],
}
"""Words by which a command does something small."""
SMALL = [(program, command) for program, command in EVERY if command in RUNS]


def words_of(command, folder):
    """Return the words of a small run that writes into a folder."""
    return [command, *(word.replace('OUT', str(folder / 'out')) for word in RUNS[command])]


@pytest.fixture(scope='module')
def data(tmp_path_factory):
    """Return one recording as a table, a bag, the MCAP of the bag, and a pattern."""
    folder = tmp_path_factory.mktemp('data')
    one, = read_recordings([TABLE], SERVO)
    bag = write_recording(folder / 'bag', one)
    mcap, = bag.glob('*.mcap')
    return {'table': TABLE, 'bag': bag, 'mcap': mcap, 'pattern': folder / 'b?g'}


@pytest.mark.parametrize('kind', KINDS)
def test_it_reads_the_same_numbers_from(data, kind):
    found, = read_recordings([data[kind]], SERVO)
    wanted, = read_recordings([TABLE], SERVO)
    assert np.array_equal(found['motor_position'], wanted['motor_position'], equal_nan=True)


@pytest.mark.parametrize(('program', 'command'), [*READING, ('servo-identify', 'experiment'),
                                                  ('servo-identify', 'watch')])
def test_it_takes_a_servo_by_path_and_by_shipped_name(program, command):
    _, actions = actions_of(program, command)
    servo = actions['--servo'] if '--servo' in actions else actions['servo']
    assert servo.type(str(SERVO)) == SERVO
    assert servo.type('rv_bench').name == 'rv_bench.yaml'


@pytest.mark.parametrize(('program', 'command'), READING)
@pytest.mark.parametrize('wrong', ['data', 'servo', 'output'])
def test_it_judges_what_it_is_told_before_it_starts(program, command, wrong, tmp_path, capsys):
    _, actions = actions_of(program, command)
    output = tmp_path / 'made' / 'out'
    bag = str(tmp_path / 'no.csv') if wrong == 'data' else str(TABLE)
    servo = 'rv_bunch' if wrong == 'servo' else str(SERVO)
    named = ['--servo', servo, bag] if '--servo' in actions else [servo, bag]
    option = '-o' if '-o' in actions else ''
    words = [command, *named, *ALSO.get(command, []), *([option, str(output)] if option else [])]
    if wrong == 'output':
        if not option:
            pytest.skip('writes nothing')
        output.mkdir(parents=True)
        for name in WRITTEN:
            (output / name).write_text('mine')
    try:
        ended = PROGRAMS[program][0](words)
    except SystemExit as problem:  # of argparse
        ended = problem.code
    said = capsys.readouterr().err
    assert ended == 2, said
    word = {'data': 'no.csv', 'servo': "did you mean 'rv_bench'?", 'output': 'already'}[wrong]
    assert word in said
    assert 'Traceback' not in said
    left = [path for path in tmp_path.rglob('*') if path.is_file() and path.read_text() != 'mine']
    assert left == []


@pytest.mark.parametrize(('program', 'command'), EVERY)
def test_it_prints_json_is_quiet_writes_over_and_says_its_version(program, command, capsys):
    _, actions = actions_of(program, command)
    assert {'--json', '--quiet', '--force', '--version'} <= set(actions)
    with pytest.raises(SystemExit) as ended:
        PROGRAMS[program][0]([command, '--version'])
    assert ended.value.code == 0
    with pytest.raises(SystemExit):
        PROGRAMS[program][0]([command, '--jason', '-'])
    one, _, two = capsys.readouterr().out.partition('\n')
    PROGRAMS[program][0](['--version'])
    assert one == capsys.readouterr().out.strip() and not two


@pytest.mark.long
@pytest.mark.parametrize(('program', 'command'), SMALL)
def test_its_json_is_one_object_and_all_that_stdout_gets(program, command, tmp_path, capfd):
    words = words_of(command, tmp_path)
    assert PROGRAMS[program][0]([*words, '--json', '-']) == 0
    told = json.loads(capfd.readouterr().out)
    assert told['made_by'].startswith(f'{program} {command} ') and told['exit_status'] == 0
    assert len(told) > len(('made_by', 'written', 'exit_status'))
    assert all(Path(path).exists() for path in told['written'])
    assert bool(told['written']) is ('-o' in words)


@pytest.mark.parametrize(('program', 'command', 'words'), [
    ('servo-identify', 'info', ['no.csv']), ('servo-identify', 'init', ['no.csv', '-o', 'S.yaml']),
    ('servo-identify', 'check', ['no.csv', '--servo', 'rv_bench']),
    ('servo-identify', 'experiment', ['dance', '--servo', 'rv_bench']),
    ('servo-identify', 'diagnose', ['no.csv', '--servo', 'rv_bench', '-o', 'answer']),
    ('servo-twin', 'replay', ['no.csv']), ('servo-twin', 'parameters', ['rv_bunch']),
    ('servo-twin', 'from-urdf', ['no.urdf', '--joint', 'knee', '-o', 'S.yaml'])])
def test_its_json_says_why_it_cannot(program, command, words, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert PROGRAMS[program][0]([command, *words, '--json', '-']) == 2
    said = capfd.readouterr()
    told = json.loads(said.out)
    assert told['exit_status'] == 2 and told['error'] in said.err and told['error']
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(('program', 'command'), SMALL)
def test_it_writes_over_what_is_there_only_when_told(program, command, tmp_path, capfd):
    words, found = words_of(command, tmp_path), tmp_path / 'found.json'
    found.write_text('mine')
    main = PROGRAMS[program][0]
    assert main([*words, '--json', str(found)]) == 2 and found.read_text() == 'mine'
    assert '--force' in capfd.readouterr().err
    assert not (tmp_path / 'out').exists()
    assert main([*words, '--json', str(found), '--force', '--quiet']) == 0
    assert json.loads(found.read_text())['exit_status'] == 0
    if '-o' in words:
        assert capfd.readouterr().out == ''
        assert main(words) == 2 and '--force' in capfd.readouterr().err
        assert main([*words, '--force']) == 0


@pytest.mark.long
def test_a_page_that_is_served_is_told_by_json_at_once(tmp_path):
    found = tmp_path / 'found.json'
    for told in ('-', str(found)):
        view = subprocess.Popen(
            [sys.executable, '-m', 'servo_twin.cli', 'view', str(TABLE), '--servo', str(SERVO),
             '--port', '0', '--json', told], stdout=subprocess.PIPE, text=True)
        try:
            if told == '-':
                lines = list(iter(view.stdout.readline, '}\n'))
                text = ''.join([*lines, '}'])
            else:
                assert view.stdout.readline().startswith('view: http')
                text = found.read_text()
            served = json.loads(text)
            assert served['made_by'].startswith('servo-twin view ')
            assert (served['exit_status'], served['control']) == (None, False)
            urlopen(served['address'], timeout=10.0).close()
        finally:
            view.send_signal(signal.SIGINT)
            said, _ = view.communicate(timeout=60.0)
        assert said == '' and view.returncode == 0
    assert json.loads(found.read_text()) == {**served, 'exit_status': 0}


@pytest.mark.parametrize('words', [
    ['results', '--parts', '-o', 'OUT/page.md', '--work', 'OUT/work'],
    ['blind-check', '--reduced', '--first', '1', '-o', 'OUT/cases', '--page',
     'OUT/comparison.md']], ids=lambda words: words[0])
def test_a_page_of_results_that_is_there_stays_unless_told(words, tmp_path, capsys):
    page = tmp_path / 'comparison.md'
    page.write_text('mine')
    words = [word.replace('OUT', str(tmp_path)) for word in words]
    assert identify(words) == 2 and '--force' in capsys.readouterr().err
    assert page.read_text() == 'mine' and list(tmp_path.iterdir()) == [page]
    if words[0] == 'results':
        assert identify([*words, '--force']) == 0 and page.read_text() != 'mine'


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('command', ['info', 'check'])
def test_it_runs_with_any_of(command, kind, data, capsys):
    assert identify([command, str(data[kind]), '--servo', str(SERVO), '--quiet']) == 0
    assert identify([command, str(data[kind]), '--servo', str(SERVO), '--json', '-']) == 0
    assert capsys.readouterr().out.lstrip().startswith(('{', '['))


def test_a_place_where_nothing_can_be_written_is_refused_before_the_work(capsys):
    for words in (['fit', '-o', '/proc/new.yaml'], ['diagnose', '-o', '/proc/answer']):
        assert identify([*words, str(TABLE), '--servo', str(SERVO)]) == 2
        assert '/proc' in (said := capsys.readouterr().err)
        assert 'nothing can be written there' in said


@pytest.mark.parametrize(('program', 'command'), SMALL)
@pytest.mark.parametrize('wrong', ['output', 'json'])
def test_what_cannot_be_written_is_refused_in_a_sentence(program, command, wrong, tmp_path,
                                                         capsys):
    words = words_of(command, Path('/proc') if wrong == 'output' else tmp_path)
    if wrong == 'json':
        words += ['--json', '/proc/found.json']
    elif not any('/proc' in word for word in words):
        pytest.skip('writes nothing')
    assert PROGRAMS[program][0](words) == 2
    said = capsys.readouterr()
    assert 'nothing can be written there' in said.err and 'Errno' not in said.err, said.err
    assert said.out == '' and list(tmp_path.iterdir()) == []
