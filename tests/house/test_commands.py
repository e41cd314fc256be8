"""What all commands have in common: the command line ..."""

from importlib.metadata import version
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
from xml.etree import ElementTree

import pytest

from servo_identify.cli import COMMANDS as IDENTIFY
from servo_identify.cli import main as identify
from servo_twin.cli import COMMANDS as TWIN
from servo_twin.cli import main as twin

ROOT = Path(__file__).resolve().parents[2]
READ = ('info', 'check', 'fit', 'diagnose', 'online', 'play', 'sinusoid', 'friction',
        'harmonic-drives')


def help_of(main, command, capsys):
    with pytest.raises(SystemExit) as ended:
        main([command, '--help'])
    assert ended.value.code == 0
    return capsys.readouterr().out


@pytest.mark.parametrize('command', READ)
def test_it_reads_data_the_same_way_in_every_command(command, capsys):
    said = help_of(identify, command, capsys)
    for word in ('BAG', 'tables', '--servo', 'shipped', '--mapping', '--namespace'):
        assert word in said


@pytest.mark.parametrize(('main', 'command'), [
    *((identify, name) for name in IDENTIFY), *((twin, name) for name in TWIN)])
def test_it_asks_before_it_writes_over_a_file(main, command, capsys):
    said = help_of(main, command, capsys)
    if re.search(r'--output', said) and command not in ('import', 'experiment', 'run', 'view'):
        assert '--force' in said  # these make a folder or a bag that must be new


@pytest.mark.parametrize('command', [*READ, 'experiment'])
def test_it_names_a_servo_file_that_is_not_there_before_anything_else(command, capsys):
    with pytest.raises(SystemExit) as ended:
        identify([command, 'nowhere', '--servo', 'rv_bunch', '-o', 'x'])
    assert ended.value.code == 2
    assert "did you mean 'rv_bench'?" in capsys.readouterr().err


def test_it_names_a_bag_that_is_not_there_and_writes_nothing(tmp_path, capsys):
    assert identify(['diagnose', str(tmp_path / 'no'), '--servo', 'rv_plain', '-o',
                     str(tmp_path / 'answer')]) == 2
    assert 'does not exist' in capsys.readouterr().err
    assert not (tmp_path / 'answer').exists()


def test_its_overview_says_what_each_command_does_those_of_other_packages_too(capsys):
    assert identify([]) == 0
    lines = capsys.readouterr().out.splitlines()
    (blind,) = (line for line in lines if line.startswith('  blind-check '))
    assert blind.split(maxsplit=1)[1].startswith('record emulated rigs')


def test_it_says_what_was_meant_by_a_command_that_is_not_there(capsys):
    assert identify(['diagnos']) == 2
    assert "did you mean 'diagnose'?" in capsys.readouterr().err


@pytest.mark.parametrize('words', [['servo_twin.cli', 'parameters', 'rv_bench'],
                                   ['servo_identify.cli', 'schema', 'servo']])
def test_it_ends_without_a_word_where_nobody_reads_on(words):
    reading, writing = os.pipe()
    with subprocess.Popen([sys.executable, '-m', *words], stdout=writing,
                          stderr=subprocess.PIPE, text=True) as process:
        os.close(reading)
        os.close(writing)
        assert process.communicate(timeout=60)[1] == ''
        assert process.returncode == 141  # 1 would say that a finding is red


@pytest.mark.parametrize('words', [
    ['init', 'run.csv', '-o', 'run.csv'],
    ['init', 'run.csv', '-o', 's', '--mapping-out', 'run.csv'],
    ['fit', '*.csv', '--servo', 'rv_plain', '-o', '../here/run.csv'],
    ['check', 'run.csv', '--servo', 'rv_plain', '--json', 'run.csv']])
def test_it_never_writes_over_the_data_that_it_reads(words, tmp_path, monkeypatch, capsys):
    (tmp_path / 'here').mkdir()
    monkeypatch.chdir(tmp_path / 'here')
    Path('run.csv').write_text('t,motor_position\n0,0\n')
    assert identify([*words, '--force']) == 2
    assert 'run.csv is a file that is read' in capsys.readouterr().err
    assert Path('run.csv').read_text() == 't,motor_position\n0,0\n'


def test_it_says_in_a_sentence_that_memory_is_short(monkeypatch, capsys):
    def full(*_args):
        raise MemoryError

    monkeypatch.setattr('servo_twin.commands.parameters.main', full)
    assert twin(['parameters']) == 2
    assert 'this machine has too little memory' in capsys.readouterr().err


def test_there_is_one_version():
    said = {ElementTree.parse(path).findtext('version') for path in ROOT.glob('src/*/package.xml')}
    first = re.search(r'^## (\d+\.\d+\.\d+)', (ROOT / 'CHANGELOG.md').read_text(), re.MULTILINE)
    cited = re.search(r'^version: (\S+)', (ROOT / 'CITATION.cff').read_text(), re.MULTILINE)
    assert said == {first[1]} == {cited[1]}


@pytest.mark.parametrize('main', [identify, twin])
def test_it_says_its_version(main, capsys):
    assert main(['--version']) == 0
    assert re.fullmatch(r'servo-(twin|identify) \d+\.\d+\.\d+\n', capsys.readouterr().out)
    assert version('servo_twin') == version('servo_identify')


def test_it_completes_commands_options_and_shipped_servos_in_bash(capsys):
    assert identify(['--completion', 'bash']) == 0
    script = capsys.readouterr().out

    def completed(*words):
        line = ' '.join(words)
        program = (f'{script}\nCOMP_WORDS=({line} "") COMP_CWORD={len(words)}\n'
                   '_servo_identify; echo "${COMPREPLY[@]}"')
        return subprocess.run(['bash', '-c', program], capture_output=True, text=True,
                              check=True).stdout.split()

    assert {'diagnose', 'init'} <= set(completed('servo-identify'))
    assert completed('servo-identify', 'diagnose', '--fail-on') == ['gap', 'unknown']
    assert 'rv_bench' in completed('servo-identify', 'check', '--servo')
    assert identify(['--completion', 'zsh']) == 0
    assert 'bashcompinit' in capsys.readouterr().out


@pytest.mark.skipif(shutil.which('zsh') is None, reason='zsh is not installed')
@pytest.mark.parametrize(('typed', 'wanted'), [
    ('servo-identify diagn', 'servo-identify diagnose'),
    ('servo-identify diagnose --fail-on u', '--fail-on unknown'),
    ('servo-identify check --servo rv_b', '--servo rv_bench'),
    ('servo-identify diagnose --despite', '--despite-check')])
def test_a_zsh_completes_what_is_typed(typed, wanted, tmp_path, capsys):
    pexpect = pytest.importorskip('pexpect')
    identify(['--completion', 'zsh'])
    (tmp_path / 'completion').write_text(capsys.readouterr().out)
    shell = pexpect.spawn('zsh', ['-f', '-i'], encoding='utf8', cwd=str(tmp_path), timeout=30,
                          dimensions=(40, 200), env={**os.environ, 'ZDOTDIR': str(tmp_path),
                                                     'HOME': str(tmp_path), 'TERM': 'dumb'})
    try:
        shell.sendline('unsetopt zle_bracketed_paste; source completion; echo is ready$((1))')
        shell.expect('is ready1')
        shell.send(f'{typed}\t')
        shell.expect_exact(wanted)
    finally:
        shell.close(force=True)


@pytest.mark.parametrize('module', [
    'servo_rig_driver.record.recorder_node', 'servo_rig_driver.driver.driver_node',
    'servo_rig_driver.can_bus.can_hub', 'servo_rig_driver.emulated.rig_process',
    'servo_twin.nodes.twin_node', 'servo_identify.nodes.identify_node'])
def test_a_process_that_is_asked_for_help_starts_nothing(module, tmp_path):
    program = f'import sys; from {module} import main; sys.exit(main())'
    ended = subprocess.run([sys.executable, '-c', program, '--help'], capture_output=True,
                           text=True, cwd=tmp_path, check=True)
    assert ended.stdout.startswith('usage: ')
    assert list(tmp_path.iterdir()) == []
