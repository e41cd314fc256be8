"""Letters and ends of text files: a table ..."""

import numpy as np
import pytest

from servo_identify.data.csv_table import read_csv
from servo_identify.data.unit_symbols import CountsError, parsed

ROWS = ''.join(f'{k};{1.5 * k};{k * k}\r\n' for k in range(200))


@pytest.mark.parametrize('encoding', ['cp1252', 'latin-1', 'mac_roman', 'cp850', 'cp437',
                                      'utf-8', 'utf-16'])
@pytest.mark.parametrize('names', ['Zeit [µs];Winkel [°];Strom [mA]',
                                   'Zeit;Winkel;Strom\r\nµs;°;mA'])
def test_has_its_units_in_the_letters_of_windows_macs_and_dos(names, encoding, tmp_path):
    path = tmp_path / 'run.csv'
    path.write_bytes(f'{names}\r\n{ROWS}'.encode(encoding))
    table = read_csv(path).table
    assert table.column_names == ['Zeit [µs]', 'Winkel [°]', 'Strom [mA]']
    assert np.array_equal(table['Winkel [°]'], 1.5 * np.arange(200))


def test_has_umlauts_of_windows_where_no_unit_tells_the_letters(tmp_path):
    path = tmp_path / 'run.csv'
    path.write_bytes(f'Zeit;Größe;Übersetzung\r\n{ROWS}'.encode('cp1252'))
    assert read_csv(path).table.column_names == ['Zeit', 'Größe', 'Übersetzung']


@pytest.mark.parametrize('ends', [b'\0' * 4096, b'\0', b'\0\0\r\n', bytes(300_000)])
def test_ends_before_what_a_logger_had_not_filled_yet(ends, tmp_path):
    path = tmp_path / 'run.csv'
    path.write_bytes(f't;angle;current\r\n{ROWS}'.encode() + ends)
    text = read_csv(path)
    assert text.table.num_rows == 200 and not text.told
    path.write_bytes(f't;angle;current\r\n{ROWS.strip()}'.encode() + ends)  # without a line end
    assert np.array_equal(read_csv(path).table['current'], np.arange(200)**2)
    path.write_bytes(b't;angle\r\n1;\0\r\n2;3\r\n')
    with pytest.raises(ValueError, match='bytes that are no letters'):
        read_csv(path)


@pytest.mark.parametrize('word', ['pts', 'Inkremente', 'Impulse'])
def test_has_counts_by_the_words_of_other_languages(word):
    with pytest.raises(CountsError):
        parsed(word)
