"""What an adapter makes of the times of messages, and says of them."""

from itertools import count
from math import isnan
from types import SimpleNamespace

from adapter_robot import BEGIN, MS, Robot, STATES
from driver_bench import wait_for
import pytest

from servo_rig_driver.adapter.adapter_findings import AdapterFindings
from servo_rig_driver.adapter.mapped_columns import read_mapping
from servo_rig_driver.adapter.sample_stream import SampleStream, SECOND
from servo_rig_driver.driver.rig_health import RigHealth


def test_it_says_what_was_left_out_for_its_time():
    robot = Robot().says(2)
    for _ in range(200):
        robot.says(0.005, stamp=lambda now: now - 12 * MS).says(0.005)
    assert '100 of its messages left out for going back in time' in robot.told
    held = [0.0]
    robot.says(2).says(2, stamp=lambda now: now // (10 * MS) * 10 * MS)
    assert 'repeating' not in robot.told  # what repeats a message does no harm
    for _ in range(200):
        held[0] += 1.0
        robot.says(0.005, stamp=lambda now: now // (10 * MS) * 10 * MS, effort=held[0])
    assert 'repeating the time of the one before with other values' in robot.told


@pytest.mark.parametrize('off', [10 * SECOND, -5 * SECOND, 10**8 * SECOND, -SECOND * 9 // 10])
def test_a_single_wrong_stamp_costs_its_message_and_no_more(off):
    robot = Robot().says(3)
    robot.says(0.005, stamp=lambda now: now + off).says(1)
    assert '1 of its messages left out for' in robot.told
    robot.says(4)
    assert robot.told == '' and robot.stream.restarts == robot.stream.lost == 0
    assert robot.stream.samples > 1390


@pytest.mark.parametrize(('pace', 'said'), [(0.7, '0.7'), (0.0, '0'), (1.3, '1.3')])
def test_it_says_that_a_clock_goes_at_another_pace(pace, said):
    robot = Robot().says(6, stamp=lambda now: SECOND + round((now - BEGIN) * pace))
    assert f'its stamps go at {said} of our time; beside a simulation set use_sim_time' in (
        robot.told)


def test_stamps_of_another_unit_make_no_samples():
    robot = Robot().says(6, stamp=lambda now: now // MS)  # ms, taken for ns
    assert 'its stamps go at 1e-06 of our time' in robot.told
    assert not robot.blocks


@pytest.mark.parametrize('begin', [0, 7])
@pytest.mark.parametrize('off', [3600, 5, -5])
def test_a_clock_that_is_set_between_two_looks_makes_no_sample_of_another_time(off, begin):
    robot = Robot().says(4.4, stamp=lambda now: now + begin * SECOND)
    before = len(robot.blocks)
    robot.says(3, stamp=lambda now: now + (begin + off) * SECOND)
    after = robot.blocks[before:]
    assert len(after) > 30
    assert all(robot.now - 3.1 * SECOND < block.stamp < robot.now for block in after)
    assert robot.stream.restarts == 1 and robot.stream.lost == 0
    assert '1 times that the samples began again: the time of /joint_states jumped' in robot.told


def test_a_clock_that_is_set_once_keeps_its_pace():
    robot = Robot().says(3)
    robot.says(5, stamp=lambda now: now + 3600 * SECOND)
    assert 'pace' not in robot.told and 'stamps go' not in robot.told


@pytest.mark.parametrize(('step', 'rate'), [(50, 20), (2, 500), (1, 1000)])
def test_the_samples_follow_messages_to_another_rate_and_that_is_told(step, rate):
    robot = Robot().says(3)
    before = len(robot.blocks)
    robot.says(4, step * MS)
    news = f'again: {STATES} comes at another rate, by now {rate} Hz'
    assert any(news in trouble.text for trouble in (*robot.health.troubles, *robot.health.past))
    later = robot.blocks[before:]
    begun = next(k for k, block in enumerate(later) if block.period == step / 1000)
    assert later[begun].sequence == 0
    assert later[begun].stamp > later[begun - 1].stamp
    assert {block.period for block in later[begun:]} == {step / 1000}
    assert robot.stream.rates == 1


def test_a_hiccup_of_a_second_leaves_the_rate_as_it_is():
    robot = Robot().says(3)
    for _ in range(3):
        robot.says(0.9, 20 * MS).says(1.2)
    assert robot.stream.rates == 0
    assert {block.period for block in robot.blocks} == {0.005}


def test_a_rate_that_was_given_is_kept():
    robot = Robot()
    robot.stream.given = 5 * MS
    robot.says(3).says(5, 20 * MS)
    assert robot.stream.rates == 0


def test_messages_without_a_stamp_that_come_in_bursts_make_no_more_samples_than_messages():
    robot = Robot()
    for _ in range(300):
        robot.says(0.01, MS // 5, stamp=lambda now: 0)  # 50 at once
        robot.now += 90 * MS
    assert robot.stream.period == 2 * MS


@pytest.mark.parametrize(('now', 'said'), [
    (0, 'use_sim_time is set, and nobody publishes /clock'), (SECOND, '/clock stands still')])
def test_it_says_that_ros_time_stands_still(now, said):
    robot = Robot()
    robot.findings.tell_time(now, 60.0)
    assert robot.told == ''
    wait_for(lambda: robot.findings.tell_time(now, 0.05) or robot.told, 'it is told', 5.0)
    assert said in robot.told
    robot.findings.tell_time(now + MS, 0.05)
    assert robot.told == ''


class TwoTopics:
    """An angle at 500 Hz, and a current and a command of another topic every ``every`` ms."""

    def __init__(self, folder, every, late=0):
        mapping = folder / 'two.yaml'
        mapping.write_text('time: {source: /angle.stamp}\ncolumns:\n'
                           '  motor_position: {source: /angle.x}\n'
                           '  current: {source: /drive.x}\n  voltage: {source: /drive.x}\n')
        self.blocks, self.health = [], RigHealth()
        stream = SampleStream(read_mapping(mapping), 0, SECOND, 5 * MS, 10,
                              self.blocks.append)
        findings = AdapterFindings(stream, self.health)
        drive = [(at * MS + MS // 3, (at + late) * MS + MS // 3)
                 for at in range(0, 6000, every)]
        told = sorted([(received, stamp, '/drive') for stamp, received in drive]
                      + [(at * MS, at * MS, '/angle') for at in range(0, 6000, 2)])
        for received, stamp, topic in told:
            value = SimpleNamespace(x=stamp / SECOND)
            findings.watches[topic].take(stream.put(topic, value, BEGIN + stamp, BEGIN + received))
            if received % SECOND == 0:
                findings.tell({'/angle': ['/a'], '/drive': ['/d']}, BEGIN + received)
        self.told = '; '.join(trouble.text for trouble in self.health.troubles)

    def lacking(self, name):
        values = [value for block in self.blocks for value in block.columns[name]]
        return sum(isnan(value) for value in values) / len(values)


@pytest.mark.parametrize('every', [2, 10, 20, 100])
def test_a_sample_waits_for_what_is_measured_more_seldom(tmp_path, every):
    two = TwoTopics(tmp_path, every)
    assert two.lacking('current') < 0.02 and two.told == ''
    for block in two.blocks[-20:]:
        assert block.columns['current'][0] == pytest.approx(block.stamp / SECOND - 1000.0)


@pytest.mark.parametrize(('every', 'late'), [(1000, 0), (10, 90)])
def test_it_says_that_samples_lack_what_comes_too_late_for_them(tmp_path, every, late):
    two = TwoTopics(tmp_path, every, late)
    assert 'current: ' in two.told and 'messages come later than a sample waits for' in two.told
    assert 'voltage' not in two.told and two.lacking('voltage') < 0.1


@pytest.mark.parametrize(('late', 'said'), [
    (-90, '/drive: its stamps are 90 ms before our clock, and those of /angle are not'),
    (-10, ''), (4, '')])
def test_it_says_that_two_topics_are_stamped_by_clocks_that_differ_by_less_than_it_mends(
        tmp_path, late, said):
    two = TwoTopics(tmp_path, 2, late)
    assert said in two.told if said else two.told == ''


def test_topics_whose_stamps_are_all_before_our_clock_are_of_one_clock(tmp_path, monkeypatch):
    put = SampleStream.put
    monkeypatch.setattr(SampleStream, 'put', lambda self, topic, value, stamp, received: put(
        self, topic, value, stamp + 50 * MS, received))  # as beside a coarse /clock
    assert TwoTopics(tmp_path, 2).told == ''


@pytest.mark.parametrize(('every', 'said'), [
    (5, '40 of 200 messages had no stamp and count by their receipt, the others by their stamp'),
    (1, '')])
def test_it_says_that_some_messages_have_no_stamp(every, said):
    k = count()
    told = Robot().says(5.0, stamp=lambda now: 0 if next(k) % every == 0 else now).told
    assert said in told if said else told == ''


def test_an_event_is_not_told_for_ever_where_simulated_time_begins_again():
    health = RigHealth()
    health.event('samples.lost', 'one was lost', 1000 * SECOND)
    health.fade(1000 * SECOND - MS)
    assert health.has('samples.lost')
    health.fade(SECOND)
    assert not health.has('samples.lost')
