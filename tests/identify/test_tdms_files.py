"""TDMS files of LabVIEW: names, units, and the times that waveforms tell."""

from init_bench import gear_motor, init
import numpy as np
import pytest

from servo_identify.data.reading import read_recordings
from servo_identify.data.tables import read_table

START = np.datetime64('2025-03-30T10:00:00.000000')
PERIOD = 0.002


def write(path, channels, period=PERIOD):
    """Write (group, name, unit, numbers, start) as waveforms; return the path."""
    tdms = pytest.importorskip('nptdms')
    with tdms.TdmsWriter(path) as file:
        file.write_segment([tdms.ChannelObject(group, name, numbers, {
            'unit_string': unit, **({'wf_increment': period, 'wf_start_offset': 0.0,
                                     'wf_start_time': start} if start is not None else {})})
            for group, name, unit, numbers, start in channels])
    return path


def test_waveforms_have_their_units_and_times(tmp_path):
    run = gear_motor()
    data = write(tmp_path / 'run.tdms', [
        ('Log', 'voltage', 'V', run['u'], START), ('Log', 'current', 'mA', 1e3 * run['i'], START),
        ('Log', 'motor angle', 'deg', np.degrees(run['theta']), START)])
    assert init(data, tmp_path) == 0
    (one,) = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert one.period == pytest.approx(PERIOD)
    for channel, name in (('voltage', 'u'), ('current', 'i'), ('motor_position', 'theta')):
        np.testing.assert_allclose(one[channel], run[name], atol=1e-9)


def test_groups_that_began_apart_are_brought_to_one_clock(tmp_path):
    rows = np.arange(50.0)
    late = START + np.timedelta64(20, 'ms')  # ten rows
    table = read_table(write(tmp_path / 'a.tdms', [('Motor', 'angle', 'rad', rows, START),
                                                   ('Load', 'angle', 'rad', rows, late)]))
    motor, load = table['Motor.angle [rad]'], table['Load.angle [rad]']
    both = np.isfinite(motor) & np.isfinite(load)
    np.testing.assert_allclose(motor[both] - load[both], 10.0)


def test_stamps_and_channels_without_times_are_read_as_they_stand(tmp_path):
    stamps = START + np.arange(4) * np.timedelta64(5, 'ms')
    table = read_table(write(tmp_path / 'a.tdms', [('', 'Time', '', stamps, None),
                                                   ('', 'angle', 'deg', np.arange(4.0), None)]))
    np.testing.assert_allclose(table['Time'], 0.005 * np.arange(4))
    assert table['angle [deg]'].tolist() == [0.0, 1.0, 2.0, 3.0]


def test_channels_of_other_times_are_interpolated_with_a_warning(tmp_path):
    tdms = pytest.importorskip('nptdms')
    with tdms.TdmsWriter(tmp_path / 'a.tdms') as file:
        file.write_segment([tdms.ChannelObject('Log', name, every * np.arange(rows), {
            'wf_increment': every * 0.001, 'wf_start_offset': 0.0})
            for name, every, rows in (('u', 1.0, 41), ('angle', 2.0, 21))])
    table = read_table(tmp_path / 'a.tdms')
    np.testing.assert_allclose(table['angle.values'], table['u.values'], atol=1e-9)
    assert 'times of their own' in table.warnings[0]


def test_what_is_no_tdms_file_is_refused_in_a_sentence(tmp_path):
    pytest.importorskip('nptdms')
    (tmp_path / 'a.tdms').write_bytes(b'TDSm' + bytes(40))
    with pytest.raises(ValueError, match='a.tdms is no TDMS file'):
        read_table(tmp_path / 'a.tdms')
