"""Tables whose columns have names and units in Chinese, Japanese or Korean."""

import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.column_names import looks_like
from servo_identify.data.csv_layout import layout_of
from servo_identify.data.physical_units import factor_to
from servo_identify.data.tables import read_table

NAMES = ('时间(s)', '电压(V)', '电流(A)', '电机位置(rad)')


@pytest.mark.parametrize('encoding', ['gbk', 'gb18030', 'utf-8', 'utf-8-sig', 'utf-16'])
def test_a_table_has_its_names_whatever_its_letters(tmp_path, encoding):
    path = tmp_path / 'a.csv'
    path.write_bytes((','.join(NAMES) + '\n0,1.5,0.2,3\n0.002,2.5,0.3,4\n').encode(encoding))
    table = read_table(path)
    assert tuple(table.columns) == NAMES
    assert table.columns[NAMES[1]].tolist() == [1.5, 2.5]


@pytest.mark.parametrize(('encoding', 'names'), [
    ('cp932', '時間[s],電流[A],モータ位置[deg]'), ('big5', '時間(s),電流(A),馬達位置(deg)'),
    ('cp949', '시간(s),전류(A),모터 위치(deg)')])
def test_japan_taiwan_and_korea_have_letters_of_their_own(tmp_path, encoding, names):
    path = tmp_path / 'a.csv'
    path.write_bytes((names + '\n0,0.2,3\n0.002,0.3,4\n').encode(encoding))
    assert ','.join(read_table(path).columns) == names


def test_a_german_table_stays_one(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_bytes('Zeit [s];Winkel [°];Spannung über R [V]\n0;1;2\n1;2;3\n'.encode('latin-1'))
    assert layout_of(path).encoding == 'latin-1'
    assert tuple(read_table(path).columns)[1] == 'Winkel [°]'


@pytest.mark.parametrize(('name', 'column'), [
    ('时间(s)', 't'), ('时间（毫秒）', 't'), ('电机电流[A]', 'current'),
    ('负载角度[度]', 'load_position'),
    ('电机位置', 'motor_position'), ('目标位置', 'reference_position'), ('母线电压', ''),
    ('实际速度', ''), ('目标速度', 'reference_velocity'), ('扭矩传感器', 'torque'),
    ('温度', 'temperature'),
    ('モータ電流', 'current'), ('負荷位置', 'load_position'), ('시간(초)', 't'),
    ('모터 전류[A]', 'current'), ('부하 각도[도]', 'load_position'),
    ('목표 위치', 'reference_position')])
def test_it_tells_columns_by_their_names(name, column):
    assert looks_like(name) == column


@pytest.mark.parametrize(('unit', 'wanted', 'factor'), [
    ('毫秒', 's', 1e-3), ('度', 'rad', np.pi / 180.0), ('弧度', 'rad', 1.0), ('毫安', 'A', 1e-3),
    ('牛·米', 'N m', 1.0), ('转/分', 'rad/s', np.pi / 30.0),
    ('밀리초', 's', 1e-3), ('도', 'rad', np.pi / 180.0)])
def test_it_understands_the_units(unit, wanted, factor):
    assert factor_to(unit, wanted) == pytest.approx(factor)


def test_init_asks_for_no_column_of_such_a_table(tmp_path, capsys):
    path, time = tmp_path / 'a.csv', np.arange(0.0, 4.0, 0.005)
    rows = '\n'.join(f'{t:.3f},{2 * np.cos(t):.4f},{np.cos(t):.4f},{20 * np.sin(3 * t):.5f}'
                     for t in time)
    path.write_bytes((','.join(NAMES) + f'\n{rows}\n').encode('gbk'))
    assert main(['init', str(path), '-o', str(tmp_path / 's.yaml'), '--no-questions']) == 2
    said = capsys.readouterr().err
    assert '--column' not in said and '--rotor-inertia' in said
