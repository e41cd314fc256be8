"""What the driver plays of the commands it got: never late, never old, never out of limits."""

from array import array
from dataclasses import replace

from drive_bench import CONFIG
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from servo_rig_driver.devices.protocols import PROTOCOLS
from servo_rig_driver.driver.driver_parameters import beyond, DECLARED
from servo_rig_driver.driver.limits import Limits, Mode
from servo_rig_driver.driver.rig_health import RigHealth
from servo_rig_driver.driver.setpoints import Receipt, Refused, SECOND, SetpointPlayer
from servo_rig_driver.emulated.drives.by_protocol import driver_parameters

MS = SECOND // 1000
LIMITS = Limits(voltage=10.0, current=5.0, velocity=2.0, lower=-1.0, upper=3.0,
                external_torque=100.0)


def player(timeout: float = 0.1) -> SetpointPlayer:
    return SetpointPlayer(timeout, LIMITS)


def test_it_plays_each_setpoint_from_its_own_instant_on():
    play = player()
    play.add(1000 * MS, Mode.VOLTAGE, 2e-3, [1.0, 2.0, 3.0], [], now=990 * MS)
    assert play.at(999 * MS, 999 * MS) is None
    heard = [play.at(k * MS, k * MS).reference for k in range(1000, 1006)]
    assert heard == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]


def test_it_counts_the_age_from_the_setpoints_own_instant():
    play = player(timeout=0.1)
    play.add(0, Mode.CURRENT, 0.0, [1.5], [], now=50 * MS)
    assert play.at(60 * MS, 60 * MS).reference == 1.5
    assert play.at(100 * MS, 100 * MS).reference == 1.5
    assert play.at(101 * MS, 101 * MS) is None
    assert play.expired == 1


def test_it_drops_a_setpoint_that_would_go_out_too_late():
    play = player(timeout=0.1)
    play.add(0, Mode.VOLTAGE, 0.0, [1.0], [], now=0)
    assert play.at(1 * MS, now=150 * MS) is None


def test_it_takes_nothing_of_a_block_that_came_too_old():
    play = player(timeout=0.1)
    receipt = play.add(0, Mode.VOLTAGE, 1e-3, [1.0] * 10, [], now=500 * MS)
    assert (receipt.too_old, play.waiting) == (10, 0)
    assert play.at(500 * MS, 500 * MS) is None


@pytest.mark.parametrize(('stamp', 'reference', 'external'), [
    (0, [], []), (-90 * SECOND, [], []), (5000 * SECOND, [], []), (500 * MS, [float('nan')], []),
    (500 * MS, [0.0], [1.0, 2.0])])
def test_it_is_off_at_once_whatever_else_the_block_that_says_so_holds(stamp, reference, external):
    play = player(timeout=0.1)
    play.add(500 * MS, Mode.VELOCITY, 1e-3, [1.0] * 5000, [], now=500 * MS)
    assert play.at(500 * MS, 500 * MS).reference == 1.0
    receipt = play.add(stamp, Mode.OFF, 0.0, reference, external, now=501 * MS)
    assert receipt.too_old == 0
    assert play.at(501 * MS, 501 * MS).mode is Mode.OFF
    assert play.at(4000 * MS, 4000 * MS) is None


def test_it_is_off_when_a_stamp_that_can_be_followed_says():
    play = player(timeout=0.1)
    play.add(0, Mode.VELOCITY, 1e-3, [1.0] * 50, [], now=0)
    play.add(20 * MS, Mode.OFF, 0.0, [], [], now=0)
    heard = [play.at(k * MS, k * MS).mode for k in (19, 20, 45)]
    assert heard == [Mode.VELOCITY, Mode.OFF, Mode.OFF]


def test_a_block_that_does_not_fit_leaves_what_waits_as_it_was():
    play = SetpointPlayer(0.1, LIMITS, capacity=6)
    play.add(0, Mode.VELOCITY, 1e-3, [0.1, 0.2, 0.3, 0.4], [], now=0)
    with pytest.raises(Refused, match='5 set-points do not fit beside the 2 that wait'):
        play.add(2 * MS, Mode.VELOCITY, 1e-3, [1.0] * 5, [], now=0)
    assert [play.at(k * MS, k * MS).reference for k in range(4)] == [0.1, 0.2, 0.3, 0.4]


def test_it_lets_a_later_block_rule_from_its_first_instant_on():
    play = player()
    play.add(0, Mode.VELOCITY, 1e-3, [0.1, 0.2, 0.3, 0.4], [], now=0)
    play.add(2 * MS, Mode.POSITION, 1e-3, [1.0, 2.0], [], now=0)
    heard = [play.at(k * MS, k * MS) for k in range(4)]
    assert [(p.mode, p.reference) for p in heard] == [
        (Mode.VELOCITY, 0.1), (Mode.VELOCITY, 0.2), (Mode.POSITION, 1.0), (Mode.POSITION, 2.0)]


def test_it_clamps_to_the_limits_and_says_so():
    play = player()
    receipt = play.add(0, Mode.POSITION, 1e-3, [-7.0, 0.0, 9.0], [500.0, 0.0, -500.0], now=0)
    assert receipt.clamped == 4
    assert 'position -7 to -1 rad' in receipt.note
    heard = [play.at(k * MS, k * MS) for k in range(3)]
    assert [(p.reference, p.external_torque) for p in heard] == [
        (-1.0, 100.0), (0.0, 0.0), (3.0, -100.0)]


def test_a_limit_that_is_set_meanwhile_holds_what_waits_and_what_plays():
    play = player()
    play.add(0, Mode.VELOCITY, 1e-3, [1.5, 1.5, -1.5, 0.1], [90.0] * 4, now=0)
    assert play.at(0, 0).reference == 1.5 and play.limited == 0
    play.limits = replace(LIMITS, velocity=0.5, external_torque=20.0)
    heard = [play.at(k * MS, k * MS) for k in (0, 1, 2, 3)]
    assert [(p.reference, p.external_torque) for p in heard] == [
        (0.5, 20.0), (0.5, 20.0), (-0.5, 20.0), (0.1, 20.0)]
    assert play.limited == 4


def test_limits_are_held_to_what_the_frames_of_a_drive_carry():
    held = LIMITS.within({Mode.VELOCITY: (-1.5, 1.0), Mode.POSITION: (-12.5, 2.5)})
    assert held == replace(LIMITS, velocity=1.0, upper=2.5)
    assert beyond(LIMITS, held) == (
        'limit.velocity = 2 rad/s (it carries 1), limit.position_upper = 3 rad (it carries 2.5)')
    assert LIMITS.within({}) == LIMITS and beyond(LIMITS, LIMITS) == ''


@pytest.mark.parametrize(('name', 'mode', 'most'), [
    ('robstride', Mode.CURRENT, 17.0 / (0.157 * 7.75)), ('cubemars', Mode.VELOCITY, 50.0),
    ('geared_dc', Mode.POSITION, 214.7483647)])
def test_a_device_says_what_its_frames_carry(name, mode, most):
    of = {one.name: one.default for one in DECLARED}
    of |= driver_parameters(CONFIG / 'drivers' / f'{name}.yaml')
    device, _ = PROTOCOLS[of['protocol']](of, RigHealth())
    assert device.carried()[mode] == (pytest.approx(-most), pytest.approx(most))


def test_it_leaves_the_external_torque_alone_where_none_is_given():
    play = player()
    play.add(0, Mode.VOLTAGE, 0.0, [1.0], [], now=0)
    assert play.at(0, 0).external_torque is None


def test_it_plays_off_as_zero_and_never_counts_it_as_run_out():
    play = player()
    play.add(0, Mode.OFF, 0.0, [], [], now=0)
    assert (play.at(0, 0).mode, play.at(0, 0).reference) == (Mode.OFF, 0.0)
    assert play.at(SECOND, SECOND) is None
    assert play.expired == 0


@pytest.mark.parametrize('start,mode,period,reference,external,words', [
    (0, 9, 1e-3, [1.0], [], 'mode 9'),
    (0, 1, 1e-3, [], [], 'no reference'),
    (0, 1, 1e-3, [1.0, float('nan')], [], r'reference\[1\] = nan'),
    (0, 1, 1e-3, [1.0], [float('inf')], r'external_torque\[0\] = inf'),
    (0, 1, 1e-3, [1.0, 2.0], [1.0], '1 values beside 2'),
    (0, 1, 0.0, [1.0, 2.0], [], 'period = 0.0 s'),
    (0, 1, float('nan'), [1.0, 2.0], [], 'period = nan s'),
    (0, 1, 1e300, [1.0, 2.0], [], 'needs one above 0, of at most 60 s'),
    (3600 * SECOND, 1, 1e-3, [1.0], [], '3600.0 s ahead'),
])
def test_it_refuses_a_block_it_cannot_play_and_keeps_what_it_had(
        start, mode, period, reference, external, words):
    play = player()
    play.add(0, Mode.VOLTAGE, 0.0, [4.0], [], now=0)
    with pytest.raises(Refused, match=words):
        play.add(start, mode, period, reference, external, now=0)
    assert play.at(0, 0).reference == 4.0


def test_a_sender_whose_clock_is_ahead_moves_nothing_after_it_said_off():
    play, ahead = player(), 20 * SECOND
    for now in range(0, SECOND, 100 * MS):
        with pytest.raises(Refused, match='starts 20.0 s ahead, and at most 1 s are allowed'):
            play.add(now + ahead, Mode.VELOCITY, 1e-3, [1.0] * 100, [], now)
    play.add(SECOND, Mode.VELOCITY, 1e-3, [1.0] * 100, [], SECOND)
    play.add(SECOND + ahead, Mode.OFF, 0.0, [], [], SECOND)
    assert play.at(SECOND, SECOND).mode is Mode.OFF
    assert play.at(SECOND + ahead, SECOND + ahead) is None and not play.waiting


def test_blocks_that_follow_each_other_may_wait_for_longer_than_the_gap():
    play = player()
    for start in range(0, 20 * SECOND, SECOND):
        play.add(start, Mode.VELOCITY, 1e-2, [1.0] * 100, [], now=0)
    play.add(20 * SECOND, Mode.OFF, 0.0, [], [], now=0)
    assert play.waiting == 2001


class Endless(list):
    """A block of a thousand million set-points that nobody has the time to look at."""

    def __len__(self):
        return 10**9

    def __iter__(self):
        raise AssertionError('it is looked at')


def test_it_refuses_a_block_beyond_its_queue_without_looking_at_each_value():
    with pytest.raises(Refused, match='holds 1000000000 set-points; at most 200000 may wait'):
        player().add(0, Mode.VELOCITY, 1e-6, Endless(), [], 0)


def test_it_refuses_more_than_fits_the_queue():
    play = SetpointPlayer(1.0, LIMITS, capacity=3)
    with pytest.raises(Refused, match='the block holds 4 set-points; at most 3 may wait'):
        play.add(0, Mode.VOLTAGE, 1e-3, [0.0] * 4, [], now=0)


blocks = st.tuples(
    st.integers(-300, 300), st.sampled_from([Mode.VOLTAGE, Mode.CURRENT, Mode.VELOCITY]),
    st.integers(1, 40), st.lists(st.floats(-50, 50), min_size=1, max_size=8))


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 50), st.integers(0, 60), blocks), max_size=15),
       st.integers(0, 200))
def test_it_never_hands_out_anything_old_early_or_out_of_limits(steps, timeout):
    play = SetpointPlayer(timeout / 1000, LIMITS)
    now = 0
    for pause, lag, (offset, mode, period, reference) in steps:
        now += pause * MS
        play.add(now + offset * MS, mode, period / 1000, reference, [], now)
        playing = play.at(now, now + lag * MS)
        if playing is not None:
            low, high = LIMITS.range(playing.mode)
            assert low <= playing.reference <= high
            assert playing.instant <= now
            assert now + lag * MS - playing.instant <= timeout * MS


@pytest.mark.parametrize('mode, references, ended', [
    (Mode.VOLTAGE, [1.0, 0.5, 0.0], 1), (Mode.VELOCITY, [1.0, 0.5], 0),
    (Mode.POSITION, [0.1, 0.5, 0.5], 1), (Mode.POSITION, [0.1, 0.5], 0), (Mode.OFF, [], 1)])
def test_it_tells_a_stream_that_ended_at_rest_from_one_that_broke_off(mode, references, ended):
    play = player()
    play.add(0, mode, 1e-3, references, [], now=0)
    for k in range(len(references) + 1):
        play.at(k * MS, k * MS)
    assert play.at(SECOND, SECOND) is None
    assert (play.ended, play.expired) == (ended, 1 - ended)


def test_it_takes_a_block_as_long_as_may_wait_and_plays_it_in_order():
    play, count = player(), 200_000
    receipt = play.add(0, Mode.VELOCITY, 1e-4, array('d', [0.5] * (count - 1) + [9.0]),
                       array('d', [0.1] * count), now=0)
    assert receipt == Receipt(count, 0, 1, 'clamped velocity 9 to 2 rad/s')
    assert play.waiting == count
    for k in (0, 1, 5, 777, count - 1):
        instant = k * MS // 10
        point = play.at(instant, instant)
        assert (point.instant, point.reference) == (instant, 2.0 if k == count - 1 else 0.5)
        assert play.waiting == count - 1 - k


def test_a_later_block_cuts_those_before_it_at_its_start_and_counts_what_waits():
    play = player()
    play.add(0, Mode.VELOCITY, 1e-3, [0.1] * 5, [], now=0)
    play.add(10 * MS, Mode.VELOCITY, 1e-3, [0.2] * 5, [], now=0)
    play.add(3 * MS, Mode.VELOCITY, 1e-3, [0.3] * 2, [], now=0)
    assert play.waiting == 5
    told = [play.at(k * MS, k * MS).reference for k in range(6)]
    assert told == [0.1, 0.1, 0.1, 0.3, 0.3, 0.3]
    assert not play.waiting
