"""Several tables become a bag each by one command; one that cannot be is left out and said."""

import json
from pathlib import Path

import numpy as np
import pytest

from servo_identify.cli import main
from servo_twin.bag import read_recording

SERVO = Path(__file__).parents[2] / 'config' / 'servos' / 'rv_bench.yaml'
TIME = np.arange(200) * 1e-3


def write(path: Path, header: str = 't,voltage,motor_position', size: float = 1.0) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, np.stack([TIME, np.sin(TIME), size * TIME**2], axis=1), '%.9g', ',',
               header=header, comments='')
    return path


def convert(folder: Path, *words: object) -> int:
    return main(['import', *map(str, words), '--servo', str(SERVO), '-o', str(folder)])


def test_a_pattern_and_a_folder_make_a_bag_of_each_table(tmp_path, capsys):
    for k in (1, 2, 3):
        write(tmp_path / 'raw' / f'run_{k}.csv', size=k)
    assert convert(tmp_path / 'new', tmp_path / 'raw' / 'run_*.csv', '--family', 'chirp',
                   '--replicate', '4') == 0
    assert convert(tmp_path / 'again', tmp_path / 'raw') == 0
    for k in (1, 2, 3):
        one = read_recording(tmp_path / 'new' / f'run_{k}')
        assert (one.family, one.replicate) == ('chirp', k + 3)
        same = read_recording(tmp_path / 'again' / f'run_{k}')
        assert np.array_equal(one['motor_position'], same['motor_position'])
        assert one['motor_position'][-1] == pytest.approx(k * TIME[-1]**2)
    assert f'3 of 3 tables are bags in {tmp_path / "again"}' in capsys.readouterr().out


def test_a_table_that_cannot_be_is_named_with_its_reason_and_the_rest_go_on(tmp_path, capsys):
    tables = [write(tmp_path / 'a.csv'), write(tmp_path / 'b.csv', 't,voltage,angle'),
              write(tmp_path / 'c.csv')]
    assert convert(tmp_path / 'new', *tables, '--json', tmp_path / 'found.json') == 1
    assert sorted(one.name for one in (tmp_path / 'new').iterdir()) == ['a', 'c']
    said = capsys.readouterr().err
    assert f'{tables[1]} has neither motor_position nor load_position' in said
    assert said.rstrip().endswith(f'2 of 3 tables are bags in {tmp_path / "new"}; left out, for '
                                  f'the reasons above: {tables[1]}')
    found = json.loads((tmp_path / 'found.json').read_text())
    assert len(found['recordings']) == 2 and list(found['left_out']) == [str(tables[1])]
    assert convert(tmp_path / 'none', tables[1], write(tmp_path / 'd.csv', 't,u,angle')) == 2
    assert not (tmp_path / 'none').exists() or not list((tmp_path / 'none').iterdir())


def test_tables_of_one_name_get_bags_of_different_names(tmp_path):
    tables = [write(tmp_path / where, size=k + 1)
              for k, where in enumerate(('a/run.csv', 'b/run.csv', 'b/run.txt', 'b/other.csv'))]
    assert convert(tmp_path / 'new', *tables) == 0
    last = {one.name: round(read_recording(one)['motor_position'][-1] / TIME[-1]**2)
            for one in (tmp_path / 'new').iterdir()}
    assert last == {'a_run': 1, 'b_run': 2, 'run_txt': 3, 'other': 4}


def test_what_is_wrong_for_all_is_said_once_and_a_bag_is_no_folder_of_bags(tmp_path, capsys):
    one, two = write(tmp_path / 'a.csv'), write(tmp_path / 'b.csv')
    (tmp_path / 'm.yaml').write_text('columns: {}')
    assert convert(tmp_path / 'new', one, two, '--mapping', tmp_path / 'm.yaml') == 2
    assert capsys.readouterr().err.count('\n') == 1 and not (tmp_path / 'new').exists()
    assert convert(tmp_path / 'bag', one) == 0
    assert convert(tmp_path / 'bag', one, two, '--force') == 2
    assert 'is a bag, and the bags of 2 tables need a folder' in capsys.readouterr().err


def test_a_note_that_many_tables_share_is_printed_once(tmp_path, capsys):
    for name in 'abc':
        write(tmp_path / f'{name}.csv', 't,current,motor_position')
    assert convert(tmp_path / 'new', tmp_path / '*.csv') == 0
    said = capsys.readouterr().err
    assert said.count('there is no voltage') == 1 and '(a, b, c)' in said


def test_a_warning_that_differs_in_its_numbers_alone_is_printed_once(tmp_path, capsys):
    for k, name in enumerate('abc'):
        kept = np.delete(np.arange(200), [50, *range(100, 101 + k % 2), 120])
        np.savetxt(tmp_path / f'{name}.csv', np.stack([TIME, TIME, TIME**2], 1)[kept], '%.9g', ',',
                   header='t,voltage,motor_position', comments='')
    assert convert(tmp_path / 'new', tmp_path / '*.csv', '--quiet') == 0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1, lines
    assert 'times are not even' in lines[0] and '(a, b, c; the numbers are of a)' in lines[0]


def test_tables_whose_columns_differ_in_a_number_of_their_name_keep_their_lines(tmp_path, capsys):
    for k in (1, 2):
        write(tmp_path / f'{k}.csv', f't,humidity_{k},motor_position')
    assert convert(tmp_path / 'new', tmp_path / '*.csv') == 0
    said = capsys.readouterr().err
    assert "['humidity_1'] are left out" in said and "['humidity_2'] are left out" in said


def test_a_bag_is_read_once_for_what_is_in_it_and_for_what_wraps_around(tmp_path, monkeypatch):
    looked = []

    def counted(recording):
        looked.append(recording)
        return [recording]

    for place in ('servo_twin.recording.parts', 'servo_identify.data.recording_facts',
                  'servo_identify.data.survey'):
        monkeypatch.setattr(f'{place}.parts_of', counted)
    assert convert(tmp_path / 'bag', write(tmp_path / 'a.csv')) == 0
    assert len(looked) == 1
