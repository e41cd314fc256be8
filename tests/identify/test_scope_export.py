"""Text that the Scope of TwinCAT exported is read with its names, units and times."""

from pathlib import Path

import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.commands import import_table as command
from servo_identify.data.table_import import import_table
from servo_identify.data.tables import read_table
from servo_identify.init.proposals import proposed
from servo_identify.init.sources import offered
from servo_twin.bag import read_recording

SERVO = Path(__file__).parents[2] / 'config' / 'servos' / 'rv_bench.yaml'
ROWS, START = 200, 132_959_553_843_760_000  # 2 ms apart; 100 ns since 1601
TIME = 2.0 * np.arange(ROWS)  # ms
ANGLE, VOLTAGE = 90.0 * np.sin(0.01 * TIME), 3.0 * np.cos(0.01 * TIME)
CHANNELS = (('motor_position', 'MAIN.fPos', '°', ANGLE),
            ('voltage', 'MAIN.fVolt', '(None)', VOLTAGE))


def exported(path: Path, *, sep: str = '\t', comma: str = ',', groups: int = 2, full: bool = True,
             stamps: bool = False, late: float = 0.0, channels: tuple = CHANNELS) -> Path:
    """Write what the Scope does; each group has times of its own, those of the last are late."""
    def shown(number: float) -> str:
        return f'{number:.9g}'.replace('.', comma)

    parts = [channels] if groups == 1 else [(one,) for one in channels]
    lines = [sep.join(cells) for cells in (
        ('Name', 'YT Scope Project'), ('File', r'C:\Scope\axis.svdx'),
        ('Starttime of export', str(START), 'Monday, 2 May 2022', '13:56:24.376'),
        ('Endtime of export', str(START + 4_000_000), 'Monday, 2 May 2022', '13:56:24.776'))]
    keys = {'Name': lambda one: one[0], 'SymbolComment': lambda one: '',
            'Data-Type': lambda one: 'REAL64', 'SampleTime[ms]': lambda one: '2',
            'IndexOffset': lambda one: '385000', 'SymbolName': lambda one: one[1],
            'Port': lambda one: '851', 'Unit': lambda one: one[2], 'Unit Offset': lambda one: '0'}
    lines += ['', *(sep.join(cell for part in parts for cell in (key, *map(of, part)))
                    for key, of in keys.items() if full or key == 'Name'), '']
    for k in range(ROWS):
        cells = []
        for n, part in enumerate(parts):
            time = TIME[k] + n * late
            cells += [str(START + round(1e4 * time)) if stamps else shown(time),
                      *(shown(one[3][k]) for one in part)]
        lines.append(sep.join(cells))
    path.write_text('\r\n'.join([*lines, 'EOF', '']), 'utf-8-sig')
    return path


@pytest.mark.parametrize('word, begin', [
    ('Einheit', 'Starttime of export'), ('Einheit', 'Startzeit des Exports'),
    ('Unité', 'Début')])
def test_it_reads_units_behind_a_key_in_another_language(tmp_path, word, begin):
    path = exported(tmp_path / 'a.csv', sep=';')
    text = path.read_text('utf-8-sig').replace('Starttime of export', begin)
    text = text.replace('SampleTime[ms]', 'Abtastzeit').replace('Unit', word)
    path.write_bytes(text.encode('cp1252'))
    found = import_table(path, SERVO)
    assert found.period == 0.002
    assert found['motor_position'] == pytest.approx(np.radians(ANGLE), abs=1e-8)


@pytest.mark.parametrize('how', [
    {}, {'groups': 1}, {'sep': ';'}, {'sep': ',', 'comma': '.', 'groups': 1}, {'stamps': True},
    {'stamps': True, 'groups': 1}], ids=str)
def test_it_needs_nothing_by_hand_where_the_channels_have_our_names(tmp_path, how):
    found = import_table(exported(tmp_path / 'a.csv', **how), SERVO)
    assert (found.period, found.warnings, len(found)) == (0.002, (), ROWS)
    assert found['motor_position'] == pytest.approx(np.radians(ANGLE), abs=1e-8)
    assert found['voltage'] == pytest.approx(VOLTAGE, abs=1e-8)


def test_a_header_of_names_alone_has_its_time_in_milliseconds(tmp_path):
    path = exported(tmp_path / 'a.csv', full=False)
    assert list(read_table(path).columns) == ['time [ms]', 'motor_position', 'voltage']
    assert proposed(offered(path))['t'][0].unit == 'ms'


def test_channels_of_one_name_have_that_of_their_symbol(tmp_path):
    channels = tuple(('fPos', symbol, unit, x) for _, symbol, unit, x in CHANNELS)
    assert list(read_table(exported(tmp_path / 'a.csv', channels=channels)).columns) == [
        'time [ms]', 'MAIN.fPos [°]', 'MAIN.fVolt']


@pytest.mark.parametrize('stamps', [False, True])
def test_columns_with_times_of_their_own_are_brought_to_one_and_said(tmp_path, stamps):
    found = import_table(exported(tmp_path / 'a.csv', late=0.5, stamps=stamps), SERVO)
    assert found.period == 0.002 and np.isnan(found['voltage'][0])
    meant = 3.0 * np.cos(0.01 * (TIME - 0.5))
    assert found['motor_position'] == pytest.approx(np.radians(ANGLE), abs=1e-8)
    assert found['voltage'][1:] == pytest.approx(meant[1:], abs=1e-3)
    assert "['voltage'] have times of their own" in found.note


@pytest.mark.parametrize('stamps', [False, True])
def test_a_long_one_is_imported_as_a_short_one(tmp_path, monkeypatch, stamps):
    path = exported(tmp_path / 'a.csv', stamps=stamps)
    found = []
    for least in (np.inf, 0.0):
        monkeypatch.setattr(command, 'IN_PARTS_FROM', least)
        bag = tmp_path / str(least)
        assert main(['import', str(path), '--servo', str(SERVO), '-o', str(bag)]) == 0
        found.append(read_recording(bag))
    assert np.array_equal(found[0]['voltage'], found[1]['voltage'])
    assert found[0].period == found[1].period == 0.002


@pytest.mark.parametrize(('first', 'step', 'unit'), [
    (START, 20_000, '100 ns'), (1_730_000_000_000_000_000, 2_000_000, 'ns'),
    (1_730_000_000_000_000, 2_000, 'us'), (1_730_000_000_000, 2, 'ms')])
def test_stamps_of_a_clock_need_no_unit(tmp_path, first, step, unit):
    path = tmp_path / 'a.csv'
    path.write_text('t,voltage,motor_position\n' + ''.join(
        f'{first + k * step},1,{k / 8}\n' for k in range(50)))
    found = import_table(path, SERVO)
    assert found.period == 0.002 and "column 't' is converted to s" in found.note
    assert proposed(offered(path))['t'][0].unit == unit


@pytest.mark.parametrize('names', ['t1;Position [°];t2;Strom [A]', 'Time 1;q [°];Time 2;i [A]'])
def test_numbered_times_are_those_of_the_columns_behind_them(tmp_path, names):
    table = tmp_path / 'a.csv'
    row = '{:.4f};{:.6f};{:.4f};{:.6f}'
    table.write_text(names + '\n' + '\n'.join(
        row.format(t, t, t + 0.0005, 3.0 * t) for t in 0.002 * np.arange(60)).replace('.', ','))
    found = read_table(table)
    time, angle, current = found.columns.values()
    assert current[1:] == pytest.approx(3.0 * (time[1:] - 0.0005)) and angle == pytest.approx(time)
    assert 'have times of their own' in found.warnings[0]


def test_two_temperatures_are_no_times(tmp_path):
    table = tmp_path / 'a.csv'
    table.write_text('T1,u,T2,i\n' + '\n'.join(
        f'{20 + (k % 3)},{k},{30 - k % 2},{k}' for k in range(40)))
    assert list(read_table(table).columns) == ['T1', 'u', 'T2', 'i']
