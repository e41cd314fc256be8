"""Tables whose columns have names and units in European languages."""

import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.column_names import likely, looks_like, NAMES
from servo_identify.data.physical_units import factor_to
from servo_identify.data.tables import read_table

HEADERS = {
    'French': 'Temps [s],Tension [V],Courant [A],Position moteur [rad],Position charge [rad]',
    'Italian': 'Tempo (s),Tensione (V),Corrente (A),Posizione motore (rad),Angolo carico (rad)',
    'Spanish': 'Tiempo [s],Tensión [V],Corriente [A],Posición motor [rad],Ángulo salida [rad]',
    'Portuguese': 'Tempo [s],Tensão [V],Corrente [A],Posição motor [rad],Posição carga [rad]',
    'German': 'Zeit [s],Spannung [V],Strom [A],Motorwinkel [rad],Lastwinkel [rad]',
    'Swedish': 'Tid [s],Spänning [V],Ström [A],Motorvinkel [rad],Lastvinkel [rad]',
    'Polish': 'Czas [s],Napięcie [V],Prąd [A],Kąt silnik [rad],Kąt load [rad]',
    'Russian': 'Время [с],Напряжение [В],Ток [А],Угол двигателя [рад],Угол нагрузки [рад]',
    'Japanese': '時間 [s],電圧 [V],電流 [A],ﾓｰﾀ角度 [rad],負荷回転角 [rad]',
}


@pytest.mark.parametrize('language', HEADERS)
def test_init_asks_for_no_column_whatever_the_language(tmp_path, capsys, language):
    path, time = tmp_path / 'a.csv', np.arange(0.0, 4.0, 0.005)
    rows = '\n'.join(f'{t:.3f},{2 * np.cos(t):.4f},{np.cos(t):.4f},{20 * np.sin(3 * t):.5f},'
                     f'{np.sin(3 * t):.5f}' for t in time)
    path.write_text(f'{HEADERS[language]}\n{rows}\n', 'utf8')
    assert main(['init', str(path), '-o', str(tmp_path / 's.yaml'), '--no-questions']) == 2
    said = capsys.readouterr().err
    assert '--column' not in said and '--rotor-inertia' in said


def test_init_proposes_the_unit_that_a_name_says_in(tmp_path, capsys):
    path, time = tmp_path / 'a.csv', np.arange(0.0, 4.0, 0.005)
    rows = '\n'.join(f'{1e3 * t:.0f};{2 * np.cos(t):.4f};{np.cos(t):.4f};{20 * np.sin(3 * t):.5f}'
                     for t in time)
    path.write_text(f'Zeit in ms;Spannung in V;Strom in A;Motorwinkel in º\n{rows}\n', 'cp1252')
    assert main(['init', str(path), '-o', str(tmp_path / 's.yaml'), '--no-questions']) == 2
    said = capsys.readouterr().err
    assert '--column' not in said and '--rotor-inertia' in said


@pytest.mark.parametrize(('name', 'column'), [
    ('Consigne de vitesse', 'reference_velocity'), ('Vitesse moteur [tr/min]', ''),
    ('Erreur de position', ''), ('Tension bus', ''), ('Température', 'temperature'),
    ('Température'.replace('é', 'e\u0301'), 'temperature'), ('Couple mesuré [Nm]', 'torque'),
    ('Posição de referência', 'reference_position'), ('Lagesollwert', 'reference_position'),
    ('Sollspannung', 'voltage'), ('u_soll', 'voltage'), ('input_voltage', ''),
    ('tension [N]', ''), ('Motorstrom', 'current'), ('tensionMoteur', 'voltage'),
    ('Kraft [N]', ''), ('message', ''), ('massage', ''), ('distance', ''), ('listing', '')])
def test_it_tells_columns_by_their_names(name, column):
    assert looks_like(name) == column


@pytest.mark.parametrize(('unit', 'wanted', 'factor'), [
    ('º/s', 'rad/s', np.pi / 180.0),
    ('tr/min', 'rad/s', np.pi / 30.0), ('giri/min', 'rad/s', np.pi / 30.0),
    ('degrés', 'rad', np.pi / 180.0), ('gradi', 'rad', np.pi / 180.0),
    ('vueltas', 'rad', 2.0 * np.pi),
    ('мА', 'A', 1e-3), ('мс', 's', 1e-3), ('об/мин', 'rad/s', np.pi / 30.0),
    ('secondes', 's', 1.0)])
def test_it_understands_the_units(unit, wanted, factor):
    assert factor_to(unit, wanted) == pytest.approx(factor)


def test_import_asks_whether_a_foreign_name_is_the_column_that_lacks():
    assert likely('Corrente', list(NAMES)) == 'current'
    assert likely('Temps', ['t']) == 't'
    assert likely('Température', ['t', 'current']) == ''


def test_it_reads_the_cyrillic_letters_of_windows(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_bytes('Время [с];Ток [А]\n0;1\n0,1;2\n'.encode('cp1251'))
    assert tuple(read_table(path).columns) == ('Время [с]', 'Ток [А]')
