"""Scales and units of object dictionaries: what is none is refused, not taken for 1."""

from __future__ import annotations

import re
import shutil

import pytest

from servo_rig_driver.devices.canopen_rig import RigFrames
from servo_rig_driver.devices.object_dictionary import DictionaryError, SHIPPED
from servo_rig_driver.devices.pdo_table import FrameError, load_frames


def changed(folder, pattern, replacement, node='drive'):
    """Return the path of the dictionaries of the bench, one of them with a line replaced."""
    own = folder / 'own'
    shutil.copytree(SHIPPED / 'rv_bench', own)
    path = own / f'{node}.eds'
    text, count = re.subn(pattern, replacement, path.read_text(), flags=re.MULTILINE)
    assert count
    path.write_text(text)
    return str(own)


@pytest.mark.parametrize('factor', ['0', '-0.0', 'nan', 'inf', '1e-400', '5e-324', '1e308', '1,5',
                                    '', 'one'])
def test_a_factor_that_is_no_scale_is_refused_with_its_line(factor, tmp_path):
    with pytest.raises(DictionaryError, match=r'drive.eds .* line \d+: Factor = '):
        load_frames(changed(tmp_path, '^Factor=.*$', f'Factor={factor}'))


@pytest.mark.parametrize(('right', 'wrong', 'node'), [
    ('rad', 'deg', 'drive'), ('A', 'mA', 'drive'), ('V', 'mV', 'drive'),
    ('rad/s', 'rpm', 'drive'), ('rad', 'turns', 'load_encoder'), ('N m', 'mN m', 'torque_sensor'),
    ('degC', 'K', 'torque_sensor')])
def test_an_object_in_another_unit_is_refused(right, wrong, node, tmp_path):
    frames = load_frames(changed(tmp_path, f'^Unit={right}$', f'Unit={wrong}', node))
    with pytest.raises(FrameError, match=f"has the unit '{wrong}'; it must be one of"):
        RigFrames(frames)


@pytest.mark.parametrize('unit', ['', 'Unit=', '; Unit=rad', 'Unit=   ; of the shaft'])
def test_a_factor_without_a_unit_is_refused_with_its_line_and_object(unit, tmp_path):
    own = changed(tmp_path, '^Unit=rad$', unit)
    with pytest.raises(DictionaryError, match=r'line \d+: Factor = .* of object 6064 has no Unit; '
                                              r'give .* Unit=rad, or Unit=1'):
        load_frames(own)


def test_a_factor_of_a_share_says_so_by_a_unit_of_one(tmp_path):
    load_frames(changed(tmp_path, '^Unit=rated torque$', 'Unit=1'))


@pytest.mark.parametrize(('unit', 'node'), [('rad', 'drive'), ('rad', 'load_encoder'),
                                            ('N m', 'torque_sensor')])
def test_a_vendors_file_without_scales_is_not_read_as_radians(unit, node, tmp_path):
    own = changed(tmp_path, f'^Factor=.*\nUnit={unit}$', '', node)
    with pytest.raises(FrameError, match='has no Unit; it must be one of'):
        RigFrames(load_frames(own))
