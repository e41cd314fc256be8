"""Texts with lines among their rows that are none: comments, names again, rows that break off."""

import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.table_import import import_tables
from servo_identify.data.tables import read_table, read_tables

NAMES = 't [s],voltage [V],current [A],motor_position [rad]'
ROWS = [f'{0.002 * k:.3f},{1.0 + k % 7},{0.1 * k:.1f},{0.01 * k:.2f}' for k in range(400)]


@pytest.fixture
def text(tmp_path):
    def write(*lines, end='\n'):
        path = tmp_path / 'a.csv'
        path.write_bytes((end.join(lines) + end).encode())
        return path

    return write


@pytest.mark.parametrize(('stray', 'said'), [
    ('# logger started again', "line 202 ('# logger started again') is a comment and left out"),
    ('# a, b, c, d', "line 202 ('# a, b, c, d') is a comment and left out"),
    (NAMES, 'the line of names stands again before row 201'),
    ('[W] overcurrent', "line 202 ('[W] overcurrent') is no row of 4 cells and left out"),
    ('0.399,2.0,4', "line 202 ('0.399,2.0,4') is no row of 4 cells and left out"),
    ('0.399,2.0,40.0,4.00,7', "line 202 ('0.399,2.0,40.0,4.00,7') is no row of 4 cells"),
    ('', ''), (',,,', '')])
@pytest.mark.parametrize('end', ['\n', '\r\n'])
def test_it_reads_all_rows_around_a_line_that_is_none(text, stray, said, end):
    table = read_table(text(NAMES, *ROWS[:200], stray, *ROWS[200:], end=end))
    assert table.columns['current [A]'].tolist() == pytest.approx([0.1 * k for k in range(400)])
    assert said in ' '.join(table.warnings) if said else not table.warnings


def test_blanks_may_part_the_rows(text):
    rows = [row.replace(',', '   ') for row in ROWS]
    table = read_table(text('t u i q', *rows[:9], '# one, two', *rows[9:]))
    assert len(table.columns['t']) == 400 and 'line 11' in table.warnings[0]


def test_decimal_commas_stay_decimal_below_names_again(text):
    rows = [row.replace(',', ';').replace('.', ',') for row in ROWS]
    table = read_table(text('t;u;i;q', *rows[:200], 't;u;i;q', *rows[200:]))
    assert table.columns['t'][-1] == pytest.approx(0.798)


def test_a_logger_that_began_again_made_two_recordings(text, tmp_path):
    path = text(NAMES, *ROWS, NAMES, *ROWS[:100])
    first, second = import_tables(path, None)
    assert [first.name, second.name] == ['a_run_1', 'a_run_2']
    assert [len(first['current']), len(second['current'])] == [400, 100]
    assert np.array_equal(second['current'], first['current'][:100])
    assert any('each is a recording of its own' in one for one in first.warnings)


@pytest.mark.parametrize(('pause', 'runs'), [(0, 1), (3600, 2)])
def test_a_clock_that_goes_on_parts_recordings_where_it_pauses_at_the_names(text, pause, runs):
    names = 't [hh:mm:ss],motor_position'
    first, second = ([f'{9 + s // 3600:02d}:00:{0.01 * k:05.2f},{k % 7}' for k in some]
                     for s, some in ((0, range(200)), (pause, range(200, 400))))
    found = import_tables(text(names, *first, names, *second), None)
    assert [len(one) for one in found] == [400 // runs] * runs
    assert {one.period for one in found} == {0.01}


def test_lines_above_the_names_may_stand_again_with_other_values(text):
    head = ('Samples,{},,', 'Y_Unit_Label,V,A,rad', NAMES)
    table = read_table(text(head[0].format(400), *head[1:], *ROWS[:300],
                            head[0].format(100), *head[1:], *ROWS[300:]))
    assert table.columns['voltage [V]'].tolist() == [1.0 + k % 7 for k in range(400)]
    assert table.warnings == ('the line of names stands again before row 301',)


def test_rows_without_times_are_not_counted_over_the_break(text):
    names, rows = 'voltage,motor_position', [row.split(',', 2)[1] + ',1' for row in ROWS]
    assert [len(run.columns['voltage']) for run in read_tables(
        text(names, *rows, names, *rows))] == [400, 400]


def test_many_rows_that_break_off_are_an_error_and_not_left_out(text):
    with pytest.raises(ValueError, match='is no table'):
        read_table(text(NAMES, *ROWS[:200], *['1,2'] * 20, *ROWS[200:]))


def test_names_alone_are_told_in_words(text, capsys):
    path = text(NAMES)
    assert main(['init', str(path), '-o', str(path.with_name('s.yaml')), '--no-questions']) == 2
    assert f"has no rows: below '{NAMES}' stands no number" in capsys.readouterr().err
