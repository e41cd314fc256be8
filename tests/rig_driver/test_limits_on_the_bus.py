"""Nothing beyond a limit reaches a drive, by what it has heard on the bus: the driver ..."""

from itertools import permutations
from math import nan

from bus_commands import Followed, STEPS
from drive_bench import bench, CONFIG, driven, NAMES, OVER_TEMPERATURE, turning
from driver_bench import DriverProcess, Listener, wait_for
import pytest
from test_drive_ends import QUICK
from test_driver_lifecycle import Hands

from servo_rig_driver.devices.drive_master import DriveState
from servo_rig_driver.driver.limits import Mode
from servo_rig_driver.emulated.drives.odrive import TORQUE

MOVES = (Mode.CURRENT, Mode.VELOCITY, Mode.POSITION)
LIMITS = {Mode.VOLTAGE: 2.0, Mode.CURRENT: 1.0, Mode.VELOCITY: 0.8, Mode.POSITION: 0.2}
LOWER = {Mode.VOLTAGE: 1.0, Mode.CURRENT: 0.5, Mode.VELOCITY: 0.3, Mode.POSITION: 0.1}
FILES = {'cybergear': 'robstride'}  # that of another drive, with a table of its own
NAMED = {Mode.VOLTAGE: ('limit.voltage',), Mode.CURRENT: ('limit.current',),
         Mode.VELOCITY: ('limit.velocity',),
         Mode.POSITION: ('limit.position_upper', 'limit.position_lower')}


class Held:
    """A driver process of a drive, and what the drive follows."""

    def __init__(self, name, made, ears):
        self.name, self.ears, self.hands = name, ears, Hands(ears)
        self.bus = Followed(name, made.channel, made.of)

    def limit(self, mode, value):
        """Set a limit; what is on its way until the next samples may be of the one before."""
        for name, sign in zip(NAMED[mode], (1.0, -1.0), strict=False):
            assert self.hands.set(name, sign * value).successful
        self.ears.more_samples(2)
        self.bus.catch_up()
        return len(self.bus.said)

    def follows(self, mode, sign, limit):
        """Command far beyond the limit until the drive follows the limit."""
        def there():
            self.ears.command(mode, [sign * 100.0 * limit] * 50, self.ears.now(), 0.01)
            return self.bus.said[-1:] == [(mode, pytest.approx(
                sign * limit, abs=STEPS.get(self.name, {}).get(mode, 1e-3)))]
        wait_for(there, f'it follows {mode.name} at its limit')

    def within(self, limits, first):
        """Check what the drive has followed since."""
        for mode, limit in limits.items():
            step = STEPS.get(self.name, {}).get(mode, 1e-3)
            assert not self.bus.beyond(mode, limit, first, step), mode


@pytest.mark.long
@pytest.mark.ros
@pytest.mark.parametrize('name', (*NAMES, 'cybergear'))
def test_it_holds_every_mode_to_its_limit_through_changes_of_mode_and_of_limits(name, tmp_path):
    file = CONFIG / 'drivers' / f'{FILES.get(name, name)}.yaml' if name != 'canopen' else None
    moves = (Mode.VOLTAGE, *MOVES) if name == 'canopen' else MOVES
    with bench(name, tmp_path) as made:
        ears = Listener(name)
        driver = DriverProcess(name, file, bus__channel=made.channel, sync_period=0.002, **QUICK,
                               **{'device__table': name} if name in FILES else {})
        held = Held(name, made, ears)
        try:
            ears.all_well()
            for mode in moves:
                assert not held.hands.set(NAMED[mode][0], nan).successful
                first = held.limit(mode, LIMITS[mode])
            for one, other in permutations(moves, 2):
                held.follows(one, 1.0, LIMITS[one])
                held.follows(other, -1.0, LIMITS[other])
            held.within(LIMITS, first)
            for mode in moves:  # while it follows what is beyond
                held.follows(mode, 1.0, LIMITS[mode])
                first = held.limit(mode, LOWER[mode])
                held.follows(mode, 1.0, LOWER[mode])
                held.within({mode: LOWER[mode]}, first)
                assert held.limit(mode, LIMITS[mode])
            for mode, other in permutations(moves, 2):  # and while it follows something else
                held.follows(mode, -1.0, LIMITS[mode])
                held.follows(other, 1.0, LIMITS[other])
                first = held.limit(mode, LOWER[mode])
                held.follows(mode, 1.0, LOWER[mode])
                held.within({mode: LOWER[mode]}, first)
                held.limit(mode, LIMITS[mode])
        finally:
            driver.close()
            held.bus.close()
            ears.close()


def test_an_axis_is_told_its_mode_each_time_before_it_is_enabled(tmp_path):
    with driven('odrive', tmp_path, fault_reset_pause=5.0) as (made, link):
        turning(link)
        made.tap.fail(OVER_TEMPERATURE['odrive'][0])
        wait_for(lambda: link.state is DriveState.FAULT, 'it is in fault')
        made.blink()  # by which its mode is that of a drive as delivered
        link.enabled()
        assert made.rig.nodes._mode == TORQUE
