"""The page of how fast things are: a benchmark writes its rows and nothing else."""

from pathlib import Path

from speed_table import with_rows

PAGE = (Path(__file__).parents[2] / 'docs' / 'speed.md').read_text('utf8')
ROW = '| a fit | 1 s | goal 2 s | 2 | `bench_fit.py`, load 0.1 |'


def test_a_run_replaces_the_rows_of_its_benchmark_and_leaves_all_else():
    before, after = set(PAGE.splitlines()), with_rows(PAGE, [ROW], ('fit',)).splitlines()
    assert set(after) - before == {ROW}
    assert all('`bench_fit.py`' in line for line in before - set(after))


def test_a_page_without_a_new_row_stays_as_it_is():
    assert with_rows(PAGE, [], ()) == PAGE
