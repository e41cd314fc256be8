"""Bags that are not whole or not one: what lacks is NaN, and what is wrong is named."""

import numpy as np
import pytest
from test_bag import recording, write_by_rosbags

from servo_twin.bag import (
    BagError,
    BagWriter,
    namespaces,
    read_predictions,
    read_recording,
    Samples,
    write_recording,
)
from servo_twin.bag.bag_topics import SAMPLE_TOPICS
from servo_twin.recording.recording import COLUMNS, Recording


def test_it_fills_lost_samples_with_nan_and_says_so(tmp_path):
    order = [k for k in range(300) if k not in (100, 101, 200)]
    write_by_rosbags(tmp_path / 'b', {'encoder': order, 'torque': list(range(300)),
                                      'current': list(range(300))})
    again = read_recording(tmp_path / 'b')
    assert list(np.flatnonzero(np.isnan(again['motor_position']))) == [100, 101, 200]
    assert np.isfinite(again['current']).all()
    assert any('3 samples lost in 2 gaps, the first at sequence 100' in warning
               for warning in again.warnings)


def test_it_joins_by_sequence_and_keeps_the_first_of_two(tmp_path):
    order = list(range(50)) + list(range(30, 100))
    write_by_rosbags(tmp_path / 'b', {'encoder': order, 'current': list(range(10, 100))})
    again = read_recording(tmp_path / 'b')
    assert again.sequence == 10
    assert np.array_equal(again['motor_position'], np.arange(10.0, 100.0))
    assert any('20 samples are there twice' in warning for warning in again.warnings)
    assert any('no topic /torque' in warning for warning in again.warnings)


def test_it_names_where_time_runs_backwards(tmp_path):
    write_by_rosbags(tmp_path / 'b', dict.fromkeys(SAMPLE_TOPICS, list(range(100))),
                     stamp=lambda k: (k if k < 60 else k - 30) * 10**6)
    with pytest.raises(BagError, match='time runs backwards from 0.059.*sequence 59 to 0.030'):
        read_recording(tmp_path / 'b')


def test_it_names_where_the_period_changes(tmp_path):
    write_by_rosbags(tmp_path / 'b', dict.fromkeys(SAMPLE_TOPICS, list(range(100))),
                     period=lambda k: 1e-3 if k < 60 else 2e-3)
    with pytest.raises(BagError, match='period changes from 0.001 s to 0.002 s at sequence 60'):
        read_recording(tmp_path / 'b')


@pytest.mark.parametrize('period', [0.0, np.nan])
def test_it_refuses_a_period_that_is_none(tmp_path, period):
    write_by_rosbags(tmp_path / 'b', dict.fromkeys(SAMPLE_TOPICS, [0, 1]), period=lambda k: period)
    with pytest.raises(BagError, match=f'period = {period} s, it must be positive'):
        read_recording(tmp_path / 'b')


def test_it_splits_where_the_driver_was_restarted(tmp_path):
    order = list(range(40)) + list(range(100))
    stamps = [k * 10**6 for k in range(40)] + [(k + 500) * 10**6 for k in range(100)]
    write_by_rosbags(tmp_path / 'b', dict.fromkeys(SAMPLE_TOPICS, order), stamp=stamps)
    again = read_recording(tmp_path / 'b')
    assert len(again) == 100 and again.start == 0.5
    assert any('stretches of [40, 100] samples' in warning for warning in again.warnings)
    assert len(read_recording(tmp_path / 'b', stretch=0)) == 40
    with pytest.raises(BagError, match='stretch = 2 is outside of'):
        read_recording(tmp_path / 'b', stretch=2)


def test_it_reads_the_longest_stretch_of_a_bag_in_which_a_driver_began_at_another_rate(tmp_path):
    orders, stamps = lives((0, range(200, 240), SAMPLE_TOPICS), (2000, range(100), SAMPLE_TOPICS))
    write_by_rosbags(tmp_path / 'b', orders, stamp=stamps,
                     period=lambda k: 2e-3 if k >= 200 else 1e-3)
    again = read_recording(tmp_path / 'b')
    assert (len(again), again.period, again.start) == (100, 1e-3, 2.0)
    assert any('stretches of [40, 100] samples at 500, 1000 Hz; number 1 is read' in warning
               for warning in again.warnings)
    assert read_recording(tmp_path / 'b', stretch=0).period == 2e-3


def lives(*runs):
    """Return numbers and stamps of drivers that were started at an ms each, by topic."""
    orders, stamps = {}, {}
    for topic in SAMPLE_TOPICS:
        heard = [(start, k) for start, numbers, topics in runs if topic in topics for k in numbers]
        orders[topic] = [k for _, k in heard]
        stamps[topic] = [(start + k) * 10**6 for start, k in heard]
    return orders, stamps


def test_it_leaves_a_driver_out_that_was_heard_on_one_topic_before_it_ended(tmp_path):
    orders, stamps = lives((0, range(1000, 1040), ('current',)),
                           (2000, range(20, 120), SAMPLE_TOPICS))
    write_by_rosbags(tmp_path / 'b', orders, stamp=stamps)
    again = read_recording(tmp_path / 'b')
    assert len(again) == 100 and again.sequence == 20 and again.start == 2.02
    assert all(np.isfinite(again[name]).all() for name in ('motor_position', 'torque', 'current'))
    assert any('40 samples of a driver that was heard on /current alone are left out' in warning
               for warning in again.warnings)


@pytest.mark.parametrize('begun', [0, 3000])
def test_it_reads_what_was_recorded_before_and_after_a_simulation_began_again(begun, tmp_path):
    orders, stamps = lives((5000, range(140), SAMPLE_TOPICS), (begun, range(100), SAMPLE_TOPICS),
                           (5010, range(50), SAMPLE_TOPICS))
    write_by_rosbags(tmp_path / 'b', orders, stamp=stamps)
    again = read_recording(tmp_path / 'b')
    assert (len(again), again.start) == (140, 5.0)
    assert any('stretches of [140, 100, 50] samples' in warning for warning in again.warnings)
    assert read_recording(tmp_path / 'b', stretch=1).start == begun / 1000
    last = read_recording(tmp_path / 'b', stretch=2)
    assert last.start == 5.01 and np.array_equal(last['motor_position'], np.arange(50.0))


def test_it_never_joins_samples_of_two_drivers_by_their_numbers(tmp_path):
    orders, stamps = lives((0, range(100), ('encoder', 'torque')), (2000, range(90), ('current',)),
                           (4000, range(30), SAMPLE_TOPICS))
    write_by_rosbags(tmp_path / 'b', orders, stamp=stamps)
    again = read_recording(tmp_path / 'b')
    assert (len(again), again.start) == (30, 4.0)
    assert np.array_equal(again['motor_position'], again['current'])
    orders, stamps = lives((0, range(100), ('encoder', 'torque')), (2000, range(90), ('current',)))
    write_by_rosbags(tmp_path / 'apart', orders, stamp=stamps)
    with pytest.raises(BagError, match='the topics have no time in common: .*/current from 2.000'):
        read_recording(tmp_path / 'apart')


def test_it_reads_what_was_recorded_before_or_after_a_long_pause(tmp_path):
    numbers = [*range(100), *range(5000, 5120), *range(60_000, 60_070)]
    write_by_rosbags(tmp_path / 'b', dict.fromkeys(SAMPLE_TOPICS, numbers))
    again = read_recording(tmp_path / 'b')
    assert (len(again), again.sequence, again.start) == (120, 5000, 5.0)
    assert any('stretches of [100, 120, 70] samples; number 1 is read' in warning
               for warning in again.warnings)
    last = read_recording(tmp_path / 'b', stretch=2)
    assert last.sequence == 60_000 and np.array_equal(last['current'], np.arange(60e3, 60_070))


def test_it_asks_which_of_several_rigs(tmp_path):
    with BagWriter(tmp_path / 'b') as bag:
        for rig in ('rig1', 'rig2'):
            bag.write_samples({
                f'{rig}/encoder': Samples('Encoder', {'motor_position': np.arange(9.0)}),
                f'{rig}/current': Samples('Current', {'current': np.arange(9.0)}),
            }, start=0, period=1e-3)
    assert namespaces(tmp_path / 'b') == ['rig1', 'rig2']
    with pytest.raises(BagError, match="several namespaces .'rig1', 'rig2'.; say which"):
        read_recording(tmp_path / 'b')
    with pytest.raises(BagError, match="no rig in namespace 'rig3'"):
        read_recording(tmp_path / 'b', 'rig3')
    assert np.array_equal(read_recording(tmp_path / 'b', '/rig2')['current'], np.arange(9.0))


def test_it_names_the_missing_topic_and_what_there_is(tmp_path):
    write_by_rosbags(tmp_path / 'b', {'encoder': [0, 1, 2]})
    with pytest.raises(BagError, match=r'no topic /current .*the bag has /encoder'):
        read_recording(tmp_path / 'b')
    with pytest.raises(BagError, match='no topic /twin/prediction'):
        read_predictions(tmp_path / 'b')


@pytest.mark.parametrize('name', ['nothing', 'empty', 'text.mcap', 'table.csv'])
def test_it_says_what_is_no_bag(tmp_path, name):
    (tmp_path / 'empty').mkdir()
    (tmp_path / 'text.mcap').write_text('hello')
    (tmp_path / 'table.csv').write_text('t,voltage\n')
    with pytest.raises(BagError, match='does not exist|is no bag|is no MCAP file'):
        read_recording(tmp_path / name)


def test_it_refuses_to_write_over_a_bag_or_without_samples(tmp_path):
    write_recording(tmp_path / 'b', recording(5))
    with pytest.raises(BagError, match='exists already'):
        write_recording(tmp_path / 'b', recording(5))
    with pytest.raises(BagError, match='without samples'):
        write_recording(tmp_path / 'c', recording(0))
    for name, start in (('d', -1.0), ('e', 2.0**31)):
        with pytest.raises(BagError, match='outside of .*ROS stamp'):
            write_recording(tmp_path / name, recording(5, start=start))
        assert not (tmp_path / name).exists()


def test_a_bag_larger_than_the_memory_is_refused_before_it_is_read(tmp_path, monkeypatch):
    from servo_twin.bag import fits_in_memory
    original = Recording('bench', 1e-3, {name: np.zeros(5000) for name in COLUMNS})
    write_recording(tmp_path / 'bag', original)
    assert len(read_recording(tmp_path / 'bag')) == 5000
    monkeypatch.setattr(fits_in_memory, 'free_memory', lambda: 1e5)
    with pytest.raises(BagError, match='GiB are free; record in parts'):
        read_recording(tmp_path / 'bag')
