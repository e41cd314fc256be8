"""A table where a command takes a bag: the commands ..."""

import json
import os

import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.reading import read_recordings
from servo_twin.cli import main as twin


@pytest.fixture(scope='module')
def table(tmp_path_factory):
    """Return a CSV of a sine of 2 Hz, 2 s at 500 Hz."""
    path = tmp_path_factory.mktemp('tables') / 'run.csv'
    time = np.arange(1000) * 2e-3
    angle = 0.1 * np.sin(4.0 * np.pi * time)
    rows = [f'{t:.6f},{np.cos(4 * np.pi * t):.9g},0.1,{161 * a:.9g},{a:.9g}'
            for t, a in zip(time, angle, strict=True)]
    path.write_text('time,voltage,current,motor_position,load_position\n' + '\n'.join(rows) + '\n')
    return path


def test_it_says_what_a_table_holds_as_json_without_a_servo_file(table, capsys):
    assert main(['info', str(table), '--json', '-']) == 0
    one, = json.loads(capsys.readouterr().out)['recordings']
    assert one['period'] == 0.002 and one['channels']['load_position']['unit'] == 'rad'


def test_it_finds_the_sinusoid_of_a_pattern_of_tables(table, capsys):
    assert main(['sinusoid', str(table.parent / '*.csv'), '--column', 'load_position',
                 '--json', '-']) == 0
    found, = json.loads(capsys.readouterr().out)['sinusoids']
    assert found['frequency'] == pytest.approx(2.0, rel=1e-6)


def test_a_pattern_of_all_leaves_out_the_list_of_families(table, tmp_path):
    (tmp_path / 'run.csv').write_bytes(table.read_bytes())
    (tmp_path / 'recordings.yaml').write_text('run: {family: sine, replicate: 2}\n')
    one, = read_recordings([tmp_path / '*'])
    assert (one.family, one.replicate) == ('sine', 2)


def test_it_replays_a_table_and_writes_no_page_over_another(table, tmp_path, capsys):
    page = tmp_path / 'page.html'
    page.write_text('mine')
    words = ['replay', str(table), '--servo', 'rv_plain', '--json', '-']
    assert twin([*words, '--page', str(page)]) == 2
    assert '--force' in capsys.readouterr().err and page.read_text() == 'mine'
    assert twin(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert {'motor_position', 'load_position'} <= {one['channel'] for one in told['channels']}
    assert twin(['replay', str(table)]) == 2
    assert '--servo must say' in capsys.readouterr().err


def test_quiet_prints_nothing_that_is_well(table, tmp_path, capsys):
    assert main(['import', str(table), '--servo', 'rv_plain', '--quiet', '-o',
                 str(tmp_path / 'deep' / 'bag')]) == 0
    assert capsys.readouterr() == ('', '')


def test_a_pipe_gets_whole_names_and_no_colours(table, capsys):
    assert main(['info', str(table)]) == 0
    said = capsys.readouterr().out
    assert '\x1b' not in said and '…' not in said and 'reference_position' in said


def test_a_pipe_is_refused_with_what_to_give(tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises(ValueError, match='pipe or a device.*to a file'):
        read_recordings([tmp_path / 'pipe'])
