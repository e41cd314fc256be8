"""The driver node beside the emulated drives that people own: it ends with the motor off."""

from contextlib import contextmanager
import signal
from time import monotonic, sleep

from drive_bench import bench, CONFIG, OVER_TEMPERATURE, WATCHDOG
from driver_bench import DriverProcess, Listener, wait_for
from held_up import held_up_since
from lifecycle_msgs.msg import Transition
import pytest
from test_driver_lifecycle import Hands

pytestmark = pytest.mark.ros

DRIVES = ('odrive', 'robstride', 'cubemars', 'moteus')
DOWN_WITHIN = 2.0  # s: quick stop 0.5, torque away 0.8, and a busy machine
QUICK = {'block_size': 10, 'retry_period': 0.1, 'listen_time': 0.05, 'heartbeat_timeout': 5.0,
         'device__watchdog': WATCHDOG,
         'fault_reset_pause': 0.1}


@contextmanager
def driver_of(made):
    """Give a driver process whose drive is enabled, and a node that listens."""
    ears = Listener(made.name)
    driver = DriverProcess(made.name, CONFIG / 'drivers' / f'{made.name}.yaml',
                           bus__channel=made.channel, **QUICK)
    try:
        ears.all_well()
        yield driver, ears
    finally:
        driver.close()
        ears.close()


def turning(made, ears):
    """Let the motor turn."""
    wait_for(lambda: ears.encoder, 'samples are heard')

    def turns():
        ears.command(3, [1.0] * 50, ears.now(), 0.01)
        return abs(made.rig.bench.state['load_speed'][0]) > 0.3
    wait_for(turns, 'the motor turns')
    made.tap.forget()


def went_down(made, since):
    """Check that the drive braked, then had no torque."""
    wait_for(lambda: not made.pushes, 'the motor has no torque')
    assert monotonic() - since < DOWN_WITHIN + held_up_since(since)
    wait_for(lambda: 'off' in made.tap.said, 'the wiretap has heard it too')
    assert [word for word in made.tap.said if word != 'drive'][:2] == ['brake', 'off']


@pytest.mark.long
@pytest.mark.parametrize('name', DRIVES)
def test_it_is_led_by_its_lifecycle_and_ends_in_order_by_two_interrupts(name, tmp_path):
    code, words = OVER_TEMPERATURE[name]
    with bench(name, tmp_path) as made, driver_of(made) as (driver, ears):
        hands = Hands(ears)
        with ears.every_sample():
            turning(made, ears)
        since = monotonic()
        assert hands.change(Transition.TRANSITION_DEACTIVATE)
        went_down(made, since)
        assert hands.change(Transition.TRANSITION_CLEANUP)
        made.tap.forget()
        sleep(0.5)
        assert not made.pushes
        assert made.tap.said in ([], ['off'])
        assert hands.change(Transition.TRANSITION_CONFIGURE)
        assert hands.change(Transition.TRANSITION_ACTIVATE)
        ears.all_well()
        made.tap.fail(code)
        ears.has_heard(f'the drive is in fault ({words})')
        ears.all_well()
        turning(made, ears)
        since = monotonic()
        for _ in range(2):
            driver.process.send_signal(signal.SIGINT)
            sleep(0.1)
        went_down(made, since)
        status, said = driver.wait()
        assert status == 0, said
        assert 'Traceback' not in said


@pytest.fixture(scope='module', params=('odrive', 'robstride', 'moteus'))
def stand(request, tmp_path_factory):
    """A drive of each protocol, for many drivers one after the other."""
    with bench(request.param, tmp_path_factory.mktemp(request.param)) as made:
        yield made


@pytest.mark.long
@pytest.mark.parametrize('end', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL,
                                 Transition.TRANSITION_ACTIVE_SHUTDOWN],
                         ids=lambda end: getattr(end, 'name', 'shutdown by its service'))
def test_however_its_driver_ends_the_motor_has_no_torque_and_stays_so(stand, end):
    with driver_of(stand) as (driver, ears):
        turning(stand, ears)
        since = monotonic()
        if isinstance(end, signal.Signals):
            driver.process.send_signal(end)
        else:
            assert Hands(ears).change(end)
        if end is signal.SIGKILL:  # nobody is left to brake it
            wait_for(lambda: not stand.pushes, 'the drive stops by its own watchdog')
            assert monotonic() - since < WATCHDOG + DOWN_WITHIN + held_up_since(since)
        else:
            went_down(stand, since)
        if isinstance(end, signal.Signals):
            status, said = driver.wait()
            assert status == (-end if end is signal.SIGKILL else 0), said
            assert 'Traceback' not in said
        stand.tap.forget()
        sleep(0.3)
        assert not stand.pushes
        assert stand.tap.said in ([], ['off'])


def test_what_a_drive_lacks_is_named_when_it_is_configured():
    ears = Listener('lacking')
    driver = DriverProcess('lacking', CONFIG / 'drivers' / 'robstride.yaml', retry_period=0.1,
                           device__kd=0.0)
    try:
        ears.hears('bus', 'device.kd = 0 N m s/rad; a drive in MIT mode needs one above 0', 2)
    finally:
        driver.close()
        ears.close()


def test_limits_beyond_what_the_frames_carry_are_told_when_it_is_configured():
    ears = Listener('beyond')
    driver = DriverProcess('beyond', CONFIG / 'drivers' / 'robstride.yaml', retry_period=0.1,
                           limit__current=50.0)
    try:
        ears.hears('command', 'do not carry limit.current = 50 A (it carries 13.97', 1)
    finally:
        driver.close()
        ears.close()
