"""A drive that takes a current, and a table that tells its set-point alone."""

import numpy as np
import pytest
from small_tables import convert, SERVO, TIME, write_csv

from servo_identify.data.current_command import with_command
from servo_identify.data.table_import import import_table
from servo_twin.bag import read_recording
from servo_twin.description import servo_file

GAIN = servo_file.load(SERVO).numbers['drive.gain']  # A/V
ASKED = np.sin(20.0 * TIME)  # A
COLUMNS = {'t': TIME, 'current_reference': ASKED, 'motor_position': TIME**2}


def test_the_set_point_over_the_gain_is_the_command(tmp_path):
    path = write_csv(tmp_path / 'run.csv', COLUMNS)
    found = import_table(path, SERVO)
    assert found['voltage'] == pytest.approx(ASKED / GAIN)
    assert found['current_reference'] == pytest.approx(ASKED)
    said, = found.warnings
    assert 'current_reference over the gain of the drive' in said and f'{GAIN:g} A/V' in said


def test_so_it_is_of_a_table_that_is_read_in_parts(tmp_path, monkeypatch):
    monkeypatch.setattr('servo_identify.commands.import_table.IN_PARTS_FROM', 0.0)
    monkeypatch.setattr('servo_identify.data.import_in_parts._BLOCK', 1 << 10)
    assert convert(write_csv(tmp_path / 'run.csv', COLUMNS), tmp_path / 'bag') == 0
    assert read_recording(tmp_path / 'bag')['voltage'] == pytest.approx(ASKED / GAIN)


def test_a_command_that_was_recorded_stays(tmp_path):
    told = COLUMNS | {'voltage': np.cos(TIME)}
    found = import_table(write_csv(tmp_path / 'run.csv', told), SERVO)
    assert found['voltage'] == pytest.approx(np.cos(TIME))


def test_a_drive_on_voltage_has_no_command_by_it():
    servo = servo_file.loads("""
servo: winding
drive: {type: voltage, resistance: 2.0, back_emf: 0.1, torque_constant: 0.1}
mechanism: {type: rigid, rotor_inertia: 1.0e-4, load_inertia: 0.0, ratio: 1.0}
""")
    told = []
    assert 'voltage' not in with_command(COLUMNS, servo, told)
    assert not told
