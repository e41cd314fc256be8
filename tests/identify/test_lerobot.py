"""Data sets of LeRobot: joints by their names, and angles as shares of their travel."""

from dataclasses import replace
import json

from bench_recording import bench_recording, SERVO
import numpy as np
import pyarrow
from pyarrow import parquet
import pytest

from servo_identify.data.recording_check import check
from servo_identify.data.tables import read_table
from servo_twin.description.servo_file import load

JOINTS = ['shoulder_pan.pos', 'elbow_flex.pos', 'gripper.pos']


def data_set(folder, names):
    """Write a data set as version 3 has it, and return its Parquet file."""
    data = folder / 'data' / 'chunk-000' / 'file-000.parquet'
    data.parent.mkdir(parents=True)
    (folder / 'meta').mkdir()
    (folder / 'meta' / 'info.json').write_text(json.dumps({'features': {
        'observation.state': {'dtype': 'float32', 'shape': [3], 'names': names}}}))
    parquet.write_table(pyarrow.table({
        'timestamp': [0.0, 0.02], 'observation.state': [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]}), data)
    return data


@pytest.mark.parametrize('names', [JOINTS, {'motors': JOINTS}])
def test_the_parts_of_a_state_have_the_names_of_their_joints(tmp_path, names):
    table = read_table(data_set(tmp_path, names))
    assert table.columns['observation.state[elbow_flex.pos]'].tolist() == [2.0, 5.0]
    assert 'observation.state[1]' not in table.columns


@pytest.mark.parametrize('names', [None, ['a', 'a', 'b'], {'motors': None}, 'abc'])
def test_parts_without_names_of_their_own_keep_their_numbers(tmp_path, names):
    table = read_table(data_set(tmp_path, names))
    assert table.columns['observation.state[1]'].tolist() == [2.0, 5.0]


@pytest.mark.parametrize('size', [1.0, np.pi / 180.0])
def test_an_angle_that_ends_at_exactly_100_is_asked_for(size):
    good = bench_recording(4.0)
    angle = np.clip(110.0 * np.sin(3.0 * good.time), -100.0, 100.0) * size

    def said(values):
        one = replace(good, columns={**good.columns, 'load_position': values})
        return [each for each in check([one], load(SERVO))
                if 'share of the travel' in each.sentence]

    found, = said(angle)
    assert found.level == 'amber' and 'scale' in found.action
    assert not said(0.99 * angle)
    assert not said(good['load_position'])
