"""One way of naming data and servo files, in all commands: each command ..."""

from pathlib import Path

import numpy as np
import pytest

from servo_identify.cli import COMMANDS as IDENTIFY
from servo_identify.cli import main as identify
from servo_identify.data.reading import read_recordings
from servo_twin.bag import write_recording
from servo_twin.cli import _parser
from servo_twin.cli import COMMANDS as TWIN
from servo_twin.cli import main as twin

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / 'docs' / 'example' / 'runs' / 'slow_reversals_1.csv'
SERVO = ROOT / 'docs' / 'example' / 'fan.yaml'
KINDS = ('table', 'bag', 'mcap', 'pattern')
PROGRAMS = {'servo-identify': (identify, IDENTIFY), 'servo-twin': (twin, TWIN)}


def actions_of(program, command):
    """Return what a command declares, by its options and the names of its arguments."""
    _, commands = PROGRAMS[program]
    package = 'servo_identify' if program == 'servo-identify' else 'servo_twin'
    parser = _parser(program, command, commands, package)[1]
    return parser, {name: action for action in parser._actions
                    for name in (action.option_strings or [action.dest])}


READING = [(program, command) for program, (_, commands) in PROGRAMS.items()
           for command in commands
           if {'bag', 'bags'} & set(actions_of(program, command)[1])
           and '--json' in actions_of(program, command)[1]]
ALSO = {'harmonic-drives': ['--held-out', str(TABLE)], 'play': ['--settings', '0.0']}
"""What a command needs beside data, servo and output."""
WRITTEN = ('report.json', 'online.csv', 'table.md', 'linear.json')
"""A file of each command that writes a folder."""


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


@pytest.mark.parametrize(('program', 'command'), READING)
def test_it_prints_json_and_can_be_quiet(program, command):
    _, actions = actions_of(program, command)
    assert {'--json', '--quiet'} <= set(actions)


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('command', ['info', 'check'])
def test_it_runs_with_any_of(command, kind, data, capsys):
    assert identify([command, str(data[kind]), '--servo', str(SERVO), '--quiet']) == 0
    assert identify([command, str(data[kind]), '--servo', str(SERVO), '--json', '-']) == 0
    assert capsys.readouterr().out.lstrip().startswith(('{', '['))
