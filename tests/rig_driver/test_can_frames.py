"""The wire is a table: golden frames with their arithmetic, round trips, and what is refused."""

from math import isnan, nan, pi

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from servo_rig_driver.devices.object_dictionary import (
    DictionaryError,
    load_dictionaries,
    NODE_IDS,
    shipped_sets,
)
from servo_rig_driver.devices.pdo_table import (
    FrameError,
    load_frames,
    sync_counter,
    sync_frame,
)

TABLE = load_frames('rv_bench')
ALL = [(name, frame) for name in shipped_sets() for frame in load_frames(name).values()]


def test_position_frame_is_counts_and_tenths_of_milliradians_a_second():
    # 10000 counts a turn: 1/4 turn = 2500 = 0x09C4; 1.5 rad/s / 1e-4 = 15000 = 0x3A98
    data = TABLE['drive.tpdo1'].encode(
        {'position_actual_value': pi / 2, 'velocity_actual_value': 1.5})
    assert data == bytes.fromhex('c4090000 983a0000')
    assert TABLE['drive.tpdo1'].cob_id == 0x181


def test_load_position_frame_is_counts_of_the_fine_encoder_and_the_sample_counter():
    # 36000 * 256 = 9216000 counts a turn; -1 turn = -9216000 = 0xFF736000
    data = TABLE['load_encoder.tpdo1'].encode({'position_value': -2 * pi, 'sample_counter': 7})
    assert data == bytes.fromhex('006073ff 07')
    assert TABLE['load_encoder.tpdo1'].cob_id == 0x182


def test_torque_frame_holds_a_value_of_24_bits():
    # 25 N m / 1e-6 = 25000000 = 0x017D7840; -3 N m / 1e-4 = -30000 = 0xFF8AD0
    data = TABLE['torque_sensor.tpdo1'].encode(
        {'transmitted_torque': 25.0, 'external_torque': -3.0, 'sample_counter': 240})
    assert data == bytes.fromhex('40787d01 d08aff f0')


def test_status_frame_holds_statusword_current_mode_and_counter():
    # statusword 0x0637; 0.735 A / 1e-6 = 735000 = 0x0B3718; mode -1 = 0xFF
    data = TABLE['drive.tpdo2'].encode({'statusword': 0x0637, 'motor_current': 0.735,
                                        'modes_of_operation_display': -1, 'sample_counter': 1})
    assert data == bytes.fromhex('3706 18370b00 ff 01')


def test_most_negative_integer_means_not_measured():
    data = TABLE['drive.tpdo3'].pack([1.5, nan])
    assert data == bytes.fromhex('60e31600 00000080')  # 1.5 V / 1e-6 = 1500000 = 0x16E360
    voltage, reference = TABLE['drive.tpdo3'].unpack(data)
    assert voltage == 1.5 and isnan(reference)


def test_sync_counts_from_1_to_240_and_starts_over():
    assert sync_frame(0) == (0x80, b'\x01')
    assert sync_frame(239) == (0x80, b'\xf0')
    assert sync_frame(240) == (0x80, b'\x01')
    assert sync_counter(481) == 2


@pytest.mark.parametrize('frame', [f for _, f in ALL], ids=[f'{n}-{f.name}' for n, f in ALL])
@given(data=st.data())
def test_every_frame_returns_what_it_was_given(frame, data):
    raw = [data.draw(st.integers(field.low, field.high)) for field in frame.fields]
    values = [n * (field.factor or 1) for n, field in zip(raw, frame.fields, strict=True)]
    assert frame.unpack(frame.pack(values)) == values


@given(st.floats(-300.0, 300.0))
def test_quantising_an_array_is_what_the_wire_does(value):
    frame = TABLE['torque_sensor.tpdo1']
    field = TABLE.field('torque_sensor', 'transmitted_torque')
    over_the_wire = frame.unpack(frame.pack([value, 0.0, 0]))[0]
    assert field.quantise(np.array([value]))[0] == over_the_wire


@pytest.mark.parametrize('size', [0, 3, 7])
def test_frame_of_the_wrong_length_is_refused_with_identifier_and_lengths(size):
    with pytest.raises(FrameError, match=rf'0x181 .* has {size} bytes, expected 8'):
        TABLE['drive.tpdo1'].unpack(bytes(size))


def test_value_out_of_range_is_refused_or_held_at_the_end():
    frame = TABLE['drive.rpdo2']
    with pytest.raises(FrameError, match='command_voltage = 5000.0 V is outside'):
        frame.pack([5000.0, 0.0])
    assert frame.unpack(frame.pack([5000.0, 0.0], clamp=True))[0] == pytest.approx(2147.483647)


def test_command_that_is_not_a_number_is_refused():
    with pytest.raises(FrameError, match='target_velocity = nan'):
        TABLE['drive.rpdo3'].pack([nan])


def test_wrong_names_are_refused_with_the_right_ones():
    with pytest.raises(FrameError, match='target_velocity'):
        TABLE['drive.rpdo3'].encode({'speed': 1.0})
    with pytest.raises(KeyError, match="no frame 'drive.tpdo9'"):
        TABLE['drive.tpdo9']


def bus_load(frames, rate, bitrate=1e6):
    """
    Return the share of a CAN bus that these frames and SYNC take at ``rate`` per second.

    Counts 47 bits beside the data of a standard frame (ISO 11898-1, with interframe space), and
    the most stuff bits that 34 + 8 n bits can take: one in four.
    """
    sizes = [1] + [frame.length for frame in frames]
    return sum(47 + 8 * n + (34 + 8 * n - 1) // 4 for n in sizes) * rate / bitrate


def test_a_bus_of_one_megabit_carries_a_kilohertz():
    sent = [TABLE[name] for name in ('drive.rpdo3', 'drive.tpdo1', 'drive.tpdo2', 'drive.tpdo3',
                                     'load_encoder.tpdo1', 'torque_sensor.tpdo1')]
    assert bus_load(sent, rate=1000.0) < 0.85


def test_other_node_ids_move_the_identifiers():
    table = load_frames('rv_bench', {'drive': 5, 'load_encoder': 6, 'torque_sensor': 7})
    assert table['drive.tpdo1'].cob_id == 0x185
    assert table.by_id[0x187].name == 'torque_sensor.tpdo1'


@pytest.mark.parametrize('ids', [{**NODE_IDS, 'drive': 2}, {**NODE_IDS, 'drive': 128},
                                 {'drive': 1}])
def test_impossible_node_ids_are_refused(ids):
    with pytest.raises(DictionaryError, match='node ids'):
        load_dictionaries('rv_bench', ids)


def test_missing_and_broken_dictionaries_are_named(tmp_path):
    with pytest.raises(DictionaryError, match='rv_bench'):
        load_dictionaries('nowhere')
    with pytest.raises(DictionaryError, match='drive.eds is missing'):
        load_dictionaries(str(tmp_path))
    (tmp_path / 'drive.eds').write_text('no section at all')
    with pytest.raises(DictionaryError, match='drive.eds is no EDS file'):
        load_dictionaries(str(tmp_path))


@pytest.mark.parametrize('name', shipped_sets())
def test_every_mapped_object_declares_unit_or_is_an_integer(name):
    for frame in load_frames(name).values():
        for field in frame.fields:
            assert (field.factor is None) == (field.unit == ''), (frame.name, field.name)
