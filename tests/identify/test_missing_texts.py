"""Texts among the numbers of a column, as instruments and spreadsheets write them: a table ..."""

import numpy as np
import pytest
from small_tables import convert

from servo_identify.cli import main
from servo_identify.commands import import_table as import_table_command
from servo_identify.data import import_in_parts
from servo_identify.data.reading import read_recordings
from servo_identify.data.table_import import import_table
from servo_identify.data.tables import read_table

TEXTS = ['OL', '-OL', 'OVER', 'OVLD', '#DIV/0!', '#N/A', '#VALUE!', '#REF!', 'n/a', '-', 'ERR',
         '1.#INF', '-1.#IND', '1.#QNAN', '-1.#INF00', 'Overflow', 'NO DATA', '***', 'Err:502',
         'sensor 3 lost']


def written(path, cells, comma=False, column='current [A]'):
    rows = [f't [s];voltage [V];{column};motor_position [rad]'] + [
        f'{0.002 * k:.3f};{1 + k % 7}.5;{cell};{0.01 * k:.2f}' for k, cell in enumerate(cells)]
    text = '\n'.join(rows)
    path.write_text(text.replace('.', ',') if comma else text)
    return path


@pytest.mark.parametrize('text', TEXTS)
@pytest.mark.parametrize('comma', [False, True])
def test_it_reads_as_nan_what_can_be_no_number(tmp_path, text, comma):
    cells = [f'{0.5 * k - 20:.1f}' for k in range(200)]
    cells[30] = cells[31] = text
    table = read_table(written(tmp_path / 'a.csv', cells, comma))
    known = table.columns['current [A]']
    assert np.flatnonzero(np.isnan(known)).tolist() == [30, 31]
    there = np.delete(np.arange(200), [30, 31])
    assert np.array_equal(known[there], 0.5 * there - 20)
    if text not in ('#N/A', 'n/a', '-', '-1.#IND', '1.#QNAN') or comma and '.' in text:  # as empty
        shown = text.replace('.', ',') if comma else text
        assert f"column 'current [A]' has '{shown}' in 2 rows, the first is row 31" in str(
            table.warnings)


def test_it_names_the_most_frequent_texts_and_keeps_the_warning_in_the_recording(tmp_path):
    cells = ['1.5'] * 200
    cells[20:30], cells[40:45], cells[50], cells[60] = ['OL'] * 10, ['ERR'] * 5, 'A!', 'B!'
    one = import_table(written(tmp_path / 'a.csv', cells), None)
    said = ("column 'current [A]' has 'OL' in 10 rows, 'ERR' in 5 rows, 'A!' in 1 row, 1 other "
            'texts, the first is row 21: no number stands there, they are NaN')
    assert said in one.warnings and said in one.note and np.isnan(one['current'][20])


@pytest.mark.parametrize(('cell', 'said'), [
    ('12 V', "has '12 V' in row 31, which is no number"),
    ("1'016", 'write no sign between thousands'), ('0L', "has '0L' in row 31"),
    ('1.2.3', "has '1.2.3' in row 31")])
def test_it_makes_no_hole_of_what_may_be_a_number(tmp_path, cell, said):
    cells = ['1.5'] * 30 + [cell] + ['2'] * 170
    table = read_table(written(tmp_path / 'a.csv', cells))
    assert said in table.refused['current [A]'] and not table.warnings


@pytest.mark.parametrize('cells', [['OL', '1.5'] * 100, ['idle', 'run', '3'] * 70])
def test_it_leaves_a_column_of_no_more_numbers_than_texts_as_text(tmp_path, cells):
    table = read_table(written(tmp_path / 'a.csv', cells))
    assert 'which is no number; leave the cell empty' in table.refused['current [A]']
    assert not table.warnings


def test_it_takes_no_hexadecimal_number_for_a_text(tmp_path):
    cells = [f'{k:04X}' for k in range(200)]
    table = read_table(written(tmp_path / 'a.csv', cells, column='raw'))
    assert 'are these hexadecimal' in table.refused['raw']


def test_it_reads_signs_between_thousands_beside_texts(tmp_path):
    cells = ['1.016,807', '12,5', 'ERR', '999,25'] * 50
    path = written(tmp_path / 'a.csv', cells)
    path.write_text(path.read_text().replace('.5;', ',5;'))
    known = read_table(path).columns['current [A]']
    assert known[:4].tolist() == pytest.approx([1016.807, 12.5, np.nan, 999.25], nan_ok=True)


def test_it_tells_runs_apart_by_texts_and_numbers(tmp_path):
    cells = [*['1'] * 90, *['2'] * 90, *['last'] * 20]
    path = written(tmp_path / 'a.csv', cells, column='run')
    with pytest.raises(ValueError, match='holds 3 recordings'):
        read_table(path)


def test_it_refuses_machines_below_each_other_one_of_which_has_a_name(tmp_path):
    rows = [f'{0.002 * k:.3f},{joint},{place + 0.01 * np.sin(0.1 * k):.4f}' for k in range(200)
            for joint, place in (('1', 0), ('2', 40), ('grip', -70))]
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join(['t,id,motor_position', *rows]))
    with pytest.raises(ValueError, match="holds its channels below each other.*'id' .1, 2, grip"):
        read_table(path)


def test_it_says_so_of_json_too(tmp_path):
    path = tmp_path / 'a.json'
    path.write_text(str({'t': [0.002 * k for k in range(9)], 'i': [*range(8), 'OL']}).replace(
        "'", '"'))
    table = read_table(path)
    assert np.isnan(table.columns['i'][8]) and "'OL' in 1 row" in table.warnings[0]


def test_its_bag_has_the_hole(tmp_path, capsys):
    cells = ['1.5'] * 30 + ['OVER'] + ['2'] * 170
    path = written(tmp_path / 'a.csv', cells)
    assert main(['info', str(path)]) == 0
    assert "'OVER' in 1 row" in ' '.join(capsys.readouterr().out.split())


@pytest.mark.parametrize('text', ['inf', '-inf', 'Infinity', '1e999'])
def test_it_takes_an_infinite_number_for_none_and_says_so(tmp_path, capsys, text):
    cells = [f'{0.5 * k - 20:.1f}' for k in range(200)]
    cells[30] = cells[31] = text
    path = written(tmp_path / 'a.csv', cells)
    one = import_table(path, None)
    said = ('current is infinite in 2 rows, the first is row 31: no number stands there, they '
            'are NaN')
    assert said in one.warnings and said in one.note
    assert np.flatnonzero(np.isnan(one['current'])).tolist() == [30, 31]
    assert main(['info', str(path)]) == 0
    assert said in ' '.join(capsys.readouterr().out.split())


def test_it_counts_infinite_numbers_in_all_parts_of_a_long_table(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(import_in_parts, '_BLOCK', 1000)
    cells = [f'{k % 7}.5' for k in range(2000)]
    cells[30] = cells[1900] = 'inf'
    monkeypatch.setattr(import_table_command, 'IN_PARTS_FROM', 0.0)
    assert convert(written(tmp_path / 'a.csv', cells), tmp_path / 'bag') == 0
    assert 'current is infinite in 2 rows, the first is row 31' in capsys.readouterr().err
    one, = read_recordings([tmp_path / 'bag'])
    assert np.flatnonzero(np.isnan(one['current'])).tolist() == [30, 1900]
