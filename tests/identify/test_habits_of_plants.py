"""Tables of plants: names in capitals, a share of the rated current, stamps of UNIX, dropouts."""

from init_bench import gear_motor, GIVEN, init, write
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.column_names import looks_like
from servo_identify.data.table_import import import_table
from servo_identify.data.tables import read_table

STAMPS = 1_764_500_000_000.0  # ms since 1970


@pytest.mark.parametrize('name', [
    'HORODATAGE (MS)', 'Heure', 'Hora', 'タイムスタンプ', '时间戳'])
def test_it_knows_the_word_for_the_time(name):
    assert looks_like(name) == 't'


@pytest.mark.parametrize(('unit', 'part'), [
    ('%', '0.0127 A for a percent of 1.27 A'), ('% NOMINAL', '0.0127 A for a percent of 1.27 A'),
    ('0.1 %', '0.00127 A for a per mille'), ('1/1000', '0.00127 A for a per mille')])
def test_it_says_what_a_share_of_the_rated_current_is_given_as(tmp_path, capsys, unit, part):
    run = gear_motor()
    data = write(tmp_path / 'a.csv', {'t [s]': run['time'], f'current [{unit}]': run['i'] / 0.05,
                                      'motor position [rad]': run['theta']})
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), *GIVEN]) == 2
    assert part in capsys.readouterr().err


def test_it_says_since_the_first_row_where_stamps_repeat_and_a_hole_begins(tmp_path):
    run = gear_motor()
    kept = (run['time'] < 2.0) | (run['time'] > 2.5)
    time = np.round(STAMPS + 1e3 * run['time'])
    time[500] = time[499]
    rows = zip(time[kept], run['u'][kept], run['i'][kept], run['theta'][kept], strict=True)
    data = tmp_path / 'a.csv'
    data.write_text('t [ms],u [V],i [A],motor_position [rad]\n' + '\n'.join(
        f'{t:.0f},{u:.6g},{i:.6g},{x:.9g}' for t, u, i, x in rows))
    assert init(data, tmp_path, '--mechanism', 'rigid') == 0
    said = str(import_table(data, tmp_path / 'new' / 's.yaml',
                            mapping=tmp_path / 'new' / 'm.yaml').warnings)
    assert 'the first is row 501 at 0.998 s after the first row' in said
    assert 'the first at 2 s after the first row; they are NaN' in said


@pytest.mark.parametrize('name', ['a.yaml', 'a.yml'])
def test_it_says_where_a_servo_file_among_the_recordings_goes(tmp_path, name):
    path = tmp_path / name
    path.write_text('servo: a')
    with pytest.raises(ValueError, match='a servo file goes behind --servo'):
        read_table(path)
