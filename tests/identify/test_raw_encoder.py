"""An import says of numbers that are no angle yet what they look like, and what to give."""

from pathlib import Path

import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.commands import import_table
from servo_identify.data.column_units import factor_of
from servo_identify.data.table_import import import_table as imported
from servo_identify.data.unwrapping import doubts, unwrapped
from servo_twin.bag import read_recording

CONFIG = Path(__file__).parents[2] / 'config'
SERVO = CONFIG / 'servos' / 'rv_bench.yaml'
TIME = np.arange(4000) * 1e-3
ANGLE = 9.0 * np.sin(2.0 * TIME)  # rad


def write(folder: Path, angle: np.ndarray, name: str = 'motor_position',
          time: np.ndarray = TIME) -> Path:
    path = folder / 'a.csv'
    np.savetxt(path, np.stack([time, np.sin(time), angle], axis=1), '%.12g', ',',
               header=f't,voltage,{name}', comments='')
    return path


def convert(path: Path, *words: object) -> int:
    return main(['import', str(path), '--servo', str(SERVO), '-o', str(path.parent / 'bag'),
                 *map(str, words)])


@pytest.mark.parametrize('least', [np.inf, 0.0], ids=['whole', 'in parts'])
@pytest.mark.parametrize('uneven', [0.0, 3e-4])
@pytest.mark.parametrize(('counts', 'words'), [
    (np.round(ANGLE * 65536 / (2 * np.pi)) % 65536,
     ("'motor_position [1/65536 rev]'", 'unit: 1/65536 rev', 'wraps: 65536')),
    (np.round(ANGLE * 500) % 2**32,
     ("'motor_position [1/4096 rev]'", 'from 0', 'wraps: 4294967296')),
    (np.round(ANGLE * 500), ("'motor_position [1/4096 rev]'", 'from -4500 to 4500'))],
    ids=['a counter of one turn', 'one of 32 bit', 'counts that go on'])
def test_counts_without_a_unit_are_refused_with_what_to_give(
        tmp_path, monkeypatch, capsys, least, uneven, counts, words):
    monkeypatch.setattr(import_table, 'IN_PARTS_FROM', least)
    time = TIME + uneven * np.sin(1e4 * TIME)
    assert convert(write(tmp_path, counts, time=time)) == 2
    said = capsys.readouterr().err
    assert 'motor_position holds whole numbers alone' in said
    assert all(word in said for word in words) and ('wraps' in said) == (len(words) == 3)
    assert not (tmp_path / 'bag').exists()


def test_what_the_refusal_of_counts_says_to_give_mends_it(tmp_path, capsys):
    path = write(tmp_path, np.round(ANGLE * 65536 / (2 * np.pi)) % 65536)
    (tmp_path / 'm.yaml').write_text(
        'time: {source: t}\ncolumns:\n  voltage: {source: voltage}\n'
        '  motor_position: {source: motor_position, wraps: 65536, unit: 1/65536 rev}\n')
    assert convert(path, '--mapping', tmp_path / 'm.yaml') == 0
    assert capsys.readouterr().err == ''
    found = imported(path, SERVO, mapping=tmp_path / 'm.yaml')['motor_position']
    assert np.allclose(found - found[0], ANGLE - ANGLE[0], atol=1e-4)


def test_counts_of_a_scale_are_asked_for_their_length(tmp_path):
    path = write(tmp_path, np.round(1e6 * np.sin(TIME)), 'load_position')
    with pytest.raises(ValueError, match=r"as in the header 'load_position \[0.5 um\]'"):
        imported(path, CONFIG / 'servos' / 'emps.yaml')


@pytest.mark.parametrize('least', [np.inf, 0.0], ids=['whole', 'in parts'])
def test_an_angle_that_wraps_around_is_imported_with_a_warning(
        tmp_path, monkeypatch, capsys, least):
    monkeypatch.setattr(import_table, 'IN_PARTS_FROM', least)
    path = write(tmp_path, np.degrees(ANGLE) % 360.0, 'motor_position [deg]')
    assert convert(path, '--quiet') == 0
    said = capsys.readouterr().err
    assert 'stays within one turn and jumps back by it' in said and 'wraps: 360' in said


def turning(rows=1000, period=1e-3, speed=20.0, bits=12):
    """Return times, and an angle of a shaft that turns in counts of one turn."""
    time = period * np.arange(rows)
    return time, np.mod(np.round(speed * time / (2.0 * np.pi) * 2**bits), 2**bits)


def test_an_encoder_that_is_read_often_enough_raises_no_doubt():
    time, counts = turning()
    assert list(doubts('motor_position', time, counts, 4096)) == []
    assert np.ptp(unwrapped(counts, 4096)) > 3 * 4096


def test_it_says_where_turns_may_be_lost_in_a_hole_or_between_slow_rows():
    time, counts = turning(speed=60.0)
    hole = np.delete(np.arange(1000), np.arange(500, 560))
    told, = doubts('motor_position', time[hole], counts[hole], 4096)
    assert 'in 1 rows, first at t = 0.56 s' in told
    told, = doubts('motor_position', time[::50], counts[::50], 4096)
    assert 'whole turns may be lost' in told


def test_it_asks_whether_the_round_is_another():
    time, counts = turning(bits=10)
    told, = doubts('motor_position', time, counts, 4096)
    assert 'between 0 and 1023' in told and 'is the round 1024 or so?' in told


@pytest.mark.parametrize('bits', [16, 32])
def test_negative_numbers_that_were_read_as_unsigned_are_refused_with_their_steps(
        tmp_path, capsys, bits):
    raw = np.round(300.0 * np.sin(5.0 * TIME)) % 2**bits
    path = tmp_path / 'a.csv'
    np.savetxt(path, np.stack([TIME, raw, ANGLE], 1), '%.12g', ',',
               header='t,current [2.69 mA],motor_position', comments='')
    assert convert(path) == 2
    steps = f'above: {2**(bits - 1) - 1}, subtract: {2**bits}'
    said = capsys.readouterr().err
    assert f'up to 300 and from {2**bits - 300} to' in said and steps in said
    mapping = tmp_path / 'm.yaml'
    mapping.write_text('time: {source: t}\ncolumns:\n  motor_position: {source: motor_position}\n'
                       f'  current: {{source: "current [2.69 mA]", {steps}, unit: 2.69 mA}}\n')
    assert convert(path, '--mapping', mapping) == 0
    one = read_recording(tmp_path / 'bag')
    np.testing.assert_allclose(one['current'], 0.00269 * np.round(300.0 * np.sin(5.0 * TIME)))


def test_a_large_whole_number_alone_is_no_negative_one(tmp_path):
    path = tmp_path / 'a.csv'
    np.savetxt(path, np.stack([TIME, 65500.0 + np.round(9.0 * np.sin(TIME)), ANGLE], 1), '%.12g',
               ',', header='t,voltage [mV],motor_position', comments='')
    assert convert(path) == 0


@pytest.mark.parametrize(('unit', 'part'), [
    ('%', '0.0127 N m for a percent'), ('0.1 %', '0.00127 N m for a per mille'),
    ('\u2030', '0.00127 N m for a per mille'),
    ('per thousand of rated torque', '0.00127 N m for a per mille')])
def test_a_share_of_the_rated_torque_is_asked_for_as_its_part(unit, part):
    with pytest.raises(ValueError, match=f'{part} of 1.27 N m'):
        factor_of('a.csv: torque', 'torque', unit, None)
