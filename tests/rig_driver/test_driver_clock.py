"""The driver's clock: the ROS time of the start, counted on by a clock that never steps."""

import re
from threading import Event, Thread
from time import monotonic_ns

from driver_bench import DriverProcess, Listener, wait_for
from lifecycle_msgs.msg import Transition
import pytest
from rosgraph_msgs.msg import Clock
from scripted_rig import ENABLED, ScriptedRig
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


class Sundial:
    """Tells all nodes with use_sim_time the time, from now on and until its end."""

    def __init__(self, node, start):
        self._topic = node.create_publisher(Clock, '/clock', 10)
        self.ahead, self._over = start - monotonic_ns(), Event()
        self._thread = Thread(target=self._tell, daemon=True)
        self._thread.start()

    def _tell(self):
        while not self._over.wait(0.002):
            message = Clock()
            message.clock.sec, message.clock.nanosec = divmod(self.now(), 10**9)
            self._topic.publish(message)

    def now(self):
        return monotonic_ns() + self.ahead

    def close(self):
        self._over.set()
        self._thread.join()


@pytest.mark.ros
def test_after_the_clock_was_set_no_command_moves_the_motor(tmp_path):
    channel = str(tmp_path / 'rig.can')
    with CanHub(channel), ScriptedRig(channel) as rig:
        ears = Listener('stepped')
        sundial = Sundial(ears.node, 10**18)
        driver = DriverProcess('stepped', bus__channel=channel, use_sim_time='true',
                               autostart='false', command_timeout=2.0, diagnostics_period=0.2)
        hands = Hands(ears)

        def is_played(volts, start):
            wait_for(lambda: ears.command(1, [volts], start()) or rig.taken[-1][1] == volts,
                     f'{volts:g} V reach the motor')
        try:
            for change in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
                assert hands.change(change)
            wait_for(lambda: rig.status == ENABLED, 'the drive is enabled')
            is_played(2.0, sundial.now)
            sundial.ahead += 20 * 10**9  # what is sent from here on would rule in 20 s
            wait_for(lambda: ears.command(1, [3.0], sundial.now()) or rig.taken[-1][1] == 0.0,
                     'the motor is at zero')
            said = ears.has_heard('command dropped, motor at zero: the clock was set by +')
            told = float(re.search(r'set by \+([0-9.]+) s', said)[1])
            assert told == pytest.approx(20.0, abs=2.0)  # a topic tells it late on a busy machine
            ears.command(1, [3.0], sundial.now() - 20 * 10**9)
            taken = len(rig.taken)
            wait_for(lambda: len(rig.taken) > taken + 100, 'samples go on')
            assert {volts for _, volts, *_ in rig.taken[taken:]} == {0.0}
            for change in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP,
                           Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
                assert hands.change(change)
            wait_for(lambda: rig.status == ENABLED, 'the drive is enabled again')
            is_played(2.0, sundial.now)
        finally:
            driver.close()
            sundial.close()
            ears.close()
