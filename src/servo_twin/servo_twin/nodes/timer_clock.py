"""The clock of all timers: one by the time of day stands still after that was set back."""

from rclpy.clock import Clock, ClockType

STEADY = Clock(clock_type=ClockType.STEADY_TIME)
