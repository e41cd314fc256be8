"""The driver's clock: the ROS time of the start, counted on by a clock that never steps."""

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
