"""The driver's clock: the ROS time of the start, counted on by a clock that never steps."""

import re
from time import time_ns

from drive_bench import Link, parameters
from driver_bench import DriverProcess, Listener, wait_for
from lifecycle_msgs.msg import Transition
import pytest
from scripted_rig import ENABLED, ScriptedRig
from stepped_clock import SteppedClock
from test_driver_lifecycle import Hands

from servo_rig_driver.can_bus.can_hub import CanHub
from servo_rig_driver.driver.steady_clock import SteadyClock

HELD_UP = 60_000_000
AHEAD = 1_000_000_000_000


def test_it_is_right_though_the_machine_stood_still_between_two_readings():
    elapsed = [0]

    def steady():
        elapsed[0] += 100
        return elapsed[0]

    def ros():
        told = AHEAD + steady()
        if elapsed[0] < 1000:  # the first readings are held up, after the clock was read
            elapsed[0] += HELD_UP
        return told
    clock = SteadyClock(ros, steady)
    assert abs(clock.now() - AHEAD - elapsed[0]) < 1000
    assert clock.steady(clock.now()) == elapsed[0]


def test_it_sees_how_far_ros_time_was_set_and_goes_on_as_before():
    elapsed, ahead = [0], [AHEAD]

    def steady():
        elapsed[0] += 100
        return elapsed[0]
    clock = SteadyClock(lambda: ahead[0] + steady(), steady)
    assert abs(clock.stepped()) < 1000
    before = clock.now()
    ahead[0] -= 3_000_000_000
    assert abs(clock.stepped() + 3_000_000_000) < 1000
    assert 0 < clock.now() - before < 10_000


def test_a_link_whose_clock_was_set_says_that_its_samples_go_by_the_one_before(tmp_path):
    ahead = [0]
    with CanHub(str(tmp_path / 'none.can')):
        made = Link(str(tmp_path / 'none.can'), parameters('robstride'))
        made.link._clock = SteadyClock(lambda: time_ns() + ahead[0])
        for said, step in ((False, 50_000_000), (True, -3_000_000_000), (False, 0)):
            ahead[0] = step
            made.link.look()
            assert made.health.has('samples.clock') == said
    assert any('set by -3.0 s' in one.text for one in made.health.past)


@pytest.mark.ros
def test_after_the_clock_was_set_no_command_moves_the_motor(tmp_path, monkeypatch):
    channel, clock = str(tmp_path / 'rig.can'), SteppedClock(tmp_path)
    if not clock.works:
        pytest.skip('the clock that can be set needs a C compiler')

    def now():
        return time_ns() + round(clock.ahead * 1e9)

    with CanHub(channel), ScriptedRig(channel) as rig:
        ears = Listener('stepped')
        with monkeypatch.context() as patched:
            for name, value in clock.environment.items():
                patched.setenv(name, value)
            driver = DriverProcess('stepped', bus__channel=channel, autostart='false',
                                   command_timeout=2.0, diagnostics_period=0.2)
        hands = Hands(ears)

        def is_played(volts, start):
            wait_for(lambda: ears.command(1, [volts], start()) or rig.taken[-1][1] == volts,
                     f'{volts:g} V reach the motor')
        try:
            for change in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
                assert hands.change(change)
            wait_for(lambda: rig.status == ENABLED, 'the drive is enabled')
            is_played(2.0, now)
            clock.set(20.0)  # what is sent from here on would rule in 20 s
            wait_for(lambda: ears.command(1, [3.0], now()) or rig.taken[-1][1] == 0.0,
                     'the motor is at zero')
            said = ears.has_heard('command dropped, motor at zero: the clock was set by +')
            ears.has_heard('samples are stamped by the clock before')
            told = float(re.search(r'set by \+([0-9.]+) s', said)[1])
            assert told == pytest.approx(20.0, abs=0.1)
            ears.command(1, [3.0], now() - 20 * 10**9)
            taken = len(rig.taken)
            wait_for(lambda: len(rig.taken) > taken + 100, 'samples go on')
            assert {volts for _, volts, *_ in rig.taken[taken:]} == {0.0}
            for change in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP,
                           Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
                assert hands.change(change)
            wait_for(lambda: rig.status == ENABLED, 'the drive is enabled again')
            is_played(2.0, now)
        finally:
            driver.close()
            ears.close()
