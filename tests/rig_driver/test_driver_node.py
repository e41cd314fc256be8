"""The driver as a process, on a bus with a rig that does what the test tells it."""

from contextlib import contextmanager
import itertools

from driver_bench import DriverProcess, instant, later, Listener, value, wait_for
import numpy as np
import pytest
from scripted_rig import ENABLED, ScriptedRig

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire
from servo_rig_driver.can_bus.can_hub import CanHub

pytestmark = pytest.mark.ros

VOLTAGE, CURRENT, VELOCITY, POSITION = 1, 2, 3, 4
PERIOD = 2_000_000
_numbers = itertools.count()


class Bench:
    """A hub, a scripted rig, a driver and a listener."""

    def __init__(self, folder, **values):
        self.channel = str(folder / 'rig.can')
        self.namespace = f'rig{next(_numbers)}'
        self.hub = CanHub(self.channel).__enter__()
        self.rig = ScriptedRig(self.channel)
        self.ears = Listener(self.namespace)
        self.driver = DriverProcess(self.namespace, bus__channel=self.channel, **values)

    def close(self):
        said = self.driver.close()
        self.rig.close()
        self.hub.__exit__()
        self.ears.close()
        return said

    def restart_hub(self):
        self.hub.__exit__()
        self.hub = CanHub(self.channel).__enter__()


@contextmanager
def running(folder, **values):
    bench = Bench(folder, **values)
    try:
        yield bench
    finally:
        bench.close()


@pytest.fixture(scope='module')
def shared_bench(tmp_path_factory):
    """One bench for all tests that leave it as they found it; 500 Hz, five samples a message."""
    with running(tmp_path_factory.mktemp('bench'), sync_period=PERIOD * 1e-9, block_size=5,
                 heartbeat_timeout=0.35, fault_reset_pause=0.1, retry_period=0.3,
                 diagnostics_period=0.2) as bench:
        yield bench


@pytest.fixture
def bench(shared_bench):
    """The shared bench with its drive enabled."""
    ears = shared_bench.ears
    wait_for(lambda: all((ears.encoder, ears.torque, ears.current)), 'samples of each kind')
    wait_for(lambda: shared_bench.rig.status == ENABLED, 'the drive is enabled')
    ears.all_well()
    return shared_bench


def test_it_samples_without_a_gap_and_joins_answers_to_the_same_sync(bench):
    with bench.ears.every_sample() as since:
        bench.ears.more_samples(200)
    told = [bench.ears.column(kept, name, since) for kept, name in (
        (bench.ears.encoder, 'motor_position'), (bench.ears.encoder, 'load_position'),
        (bench.ears.torque, 'torque'), (bench.ears.current, 'current'))]
    count = min(len(numbers) for numbers, _ in told)
    assert count >= 1000
    numbers, columns = zip(*((n[:count], column[:count]) for n, column in told), strict=True)
    unit = 2 * np.pi / 10000  # the coarsest scale among them, the motor's counts
    for k in range(1, 4):
        np.testing.assert_array_equal(numbers[k], numbers[0])
        assert np.abs(columns[k] - columns[0]).max() <= 0.51 * unit
    assert (np.diff(columns[3]) > 0.9e-3).all()


def test_it_stamps_sample_k_with_a_multiple_of_the_period(bench):
    bench.ears.more_samples(20)
    kept = bench.ears.encoder
    origins = {instant(message) - message.sequence * PERIOD for message in kept}
    assert len(origins) == 1
    assert {message.period for message in kept} == {PERIOD * 1e-9}
    assert {len(message.load_position) for message in kept} == {5}


def test_it_gives_all_three_topics_the_same_sequence_and_stamps(bench):
    since = bench.ears.more_samples(20)
    kinds = (bench.ears.encoder, bench.ears.torque, bench.ears.current)
    heads = [[(m.sequence, instant(m)) for m in later(kind, since)[:20]] for kind in kinds]
    assert heads[0] == heads[1] == heads[2]


def test_it_measures_the_temperature_that_comes_every_tenth_sync(bench):
    bench.ears.more_samples(5)
    assert set(bench.ears.current[-1].temperature) == {25.0}
    assert np.isnan(bench.ears.current[-1].current_reference).all()


def test_it_publishes_fewer_joint_states_with_velocities(bench):
    ears = bench.ears
    since = ears.more_samples(100)
    until = ears.now()
    ears.more_samples(1)  # all up to then is heard

    def states():
        return [state for state in ears.joint_states if since < instant(state) <= until]

    def neighbours():  # 0.02 s apart: none was lost between them
        return [(one, next_) for one, next_ in itertools.pairwise(states())
                if instant(next_) - instant(one) == 20_000_000]
    before, last = wait_for(neighbours, 'joint states of that time')[-1]
    assert len(states()) <= (until - since) * 1e-9 * 50 + 1
    assert last.name == ['motor', 'load']
    assert last.velocity[1] == pytest.approx((last.position[1] - before.position[1]) / 0.02)
    assert 0.0 < last.velocity[1] < 0.51  # 1e-3 rad a sample of 2 ms, less where one is left out
    encoder, current, torque = (
        next(m for m in reversed(kept) if instant(m) <= instant(last))
        for kept in (ears.encoder, ears.current, ears.torque))
    assert encoder.sequence == current.sequence == torque.sequence
    k = (instant(last) - instant(current)) // PERIOD
    assert list(last.position) == [encoder.motor_position[k], encoder.load_position[k]]
    assert last.effort[0] == pytest.approx(0.4878 * current.current[k])
    assert last.effort[1] == torque.torque[k]


def test_its_frame_is_one_of_the_bench_and_not_the_namespace(bench):
    frames = {kept[-1].header.frame_id for kept in (
        bench.ears.encoder, bench.ears.torque, bench.ears.current, bench.ears.joint_states)}
    assert frames == {f'{bench.ears.node.get_namespace()[1:]}/base_link'}


def test_it_plays_a_setpoint_at_its_very_sample(bench):
    ears = bench.ears

    def played():
        since = ears.more_samples(1)
        start = ears.now() + 200 * PERIOD
        ears.command(VOLTAGE, [1.0, 2.0, 3.0], start, PERIOD * 1e-9)
        wait_for(lambda: later(ears.current, start + 80 * PERIOD), 'the command is over')
        told = dict(zip(*ears.column(ears.current, 'voltage', since), strict=True))
        origin = instant(ears.current[-1]) - ears.current[-1].sequence * PERIOD
        first = (start - origin + PERIOD - 1) // PERIOD
        assert not any(volts for number, volts in told.items() if number < first)
        volts = [told.get(first + k, 0.0) for k in range(3)]
        return all(volts) and volts  # a busy machine hears a command late, or leaves samples out
    np.testing.assert_allclose(wait_for(played, 'a command that is heard in time'),
                               [1.0, 2.0, 3.0])


def test_it_brings_the_motor_to_zero_when_commands_stay_away(bench):
    ears = bench.ears

    def held():
        since = ears.more_samples(1)
        start = ears.now() + 200 * PERIOD
        ears.command(VOLTAGE, [2.5], start, external=[40.0])
        wait_for(lambda: later(ears.current, start + 100 * PERIOD), 'the set-point is over')
        numbers, volts = ears.column(ears.current, 'voltage', since)
        origin = instant(ears.current[-1]) - ears.current[-1].sequence * PERIOD
        after = origin + numbers[volts != 0.0] * PERIOD - start
        assert len(after) == 0 or (after.min() >= 0 and after.max() <= 100_000_000)
        return len(after) > 10  # a busy machine hears it late
    wait_for(held, 'a set-point that is heard in time is held')
    assert bench.rig.taken[-1][:2] == (-1, 0.0)
    assert 40.0 in bench.rig.external
    assert bench.rig.external[-1] == 0.0
    ears.hears('command', 'no set-point younger than command_timeout = 0.1 s is left', 1)


def followed(bench, mode, reference, told):
    """Command again and again, as a busy machine hears it late, until the drive is told so."""
    mark = len(bench.rig.taken)

    def heard():
        bench.ears.command(mode, [reference], bench.ears.now() + 20 * PERIOD)
        bench.ears.more_samples(10)
        return told in [taken[:2] for taken in bench.rig.taken[mark:]]
    wait_for(heard, 'the drive has the target')


@pytest.mark.parametrize('mode,drive_mode,reference,column', [
    (CURRENT, -2, 1.25, None), (VELOCITY, 9, 0.5, 'reference_velocity'),
    (POSITION, 8, -1.5, 'reference_position')])
def test_it_takes_commands_in_every_mode(bench, mode, drive_mode, reference, column):
    before = bench.ears.more_samples(1)
    followed(bench, mode, reference, (drive_mode, reference))
    bench.ears.more_samples(60)
    for name in ('reference_velocity', 'reference_position'):
        _, values = bench.ears.column(bench.ears.current, name, before)
        assert (reference in values) == (name == column)
        assert np.isnan(values).any()


def test_it_clamps_a_command_to_the_limits_and_says_so(bench):
    followed(bench, VELOCITY, 99.0, (9, 2.0))
    bench.ears.hears('command', 'command limited: clamped velocity 99 to 2 rad/s', 1)


def test_it_follows_nobody_while_two_publish_commands(bench):
    bench.ears.command(VOLTAGE, [1.0] * 20000, bench.ears.now(), PERIOD * 1e-9)
    wait_for(lambda: bench.rig.taken[-1][1] == 1.0, 'the command is played')
    other = Listener(bench.namespace)
    try:
        said = bench.ears.hears('command', 'no set-point is taken and the motor is at zero', 2)
        assert '2 publishers on command' in said.message
        wait_for(lambda: bench.rig.taken[-1][1] == 0.0, 'the motor is at zero')
        mark = len(bench.rig.taken)
        for who in (bench.ears, other):
            who.command(VOLTAGE, [5.0] * 100, bench.ears.now(), PERIOD * 1e-9)
        bench.ears.more_samples(60)
        assert not any(taken[1] for taken in bench.rig.taken[mark:])
    finally:
        other.close()
    wait_for(lambda: '2 publishers' not in bench.ears.status('command').message, 'one is left')
    followed(bench, VOLTAGE, 2.0, (-1, 2.0))


def test_it_refuses_a_command_that_is_no_number_and_says_so(bench):
    bench.ears.command(VOLTAGE, [float('nan')], bench.ears.now())
    bench.ears.hears('command', 'reference[0] = nan; every value must be finite', 1)


def test_it_says_that_a_command_has_no_stamp(bench):
    bench.ears.command(VOLTAGE, [7.0], 0)
    bench.ears.hears('command', 'command refused: header.stamp is not set', 1)


def test_it_says_that_a_command_came_too_old(bench):
    mark = len(bench.rig.taken)
    bench.ears.command(VOLTAGE, [7.0], bench.ears.now() - 10**9)
    bench.ears.hears('command', '1 of 1 set-points were older than command_timeout', 1)
    assert 7.0 not in [t[1] for t in bench.rig.taken[mark:]]


def test_it_counts_frames_of_the_wrong_length_and_loses_nothing(bench):
    with bench.ears.every_sample():
        bench.rig.send([(0x182, b'\x01\x02\x03'), (0x281, b''), (0x183, bytes(7))])
        status = bench.ears.hears('samples', 'has 7 bytes, expected 8; left out', 1)
        assert int(value(status, 'wrong_length')) >= 3
        bench.ears.more_samples(50)


def test_it_resets_a_fault_of_the_drive_and_goes_on_sampling(bench):
    with bench.ears.every_sample():
        bench.ears.command(VOLTAGE, [1.0] * 2000, bench.ears.now(), PERIOD * 1e-9)
        wait_for(lambda: bench.rig.taken[-1][1] == 1.0, 'the command is played')
        mark = len(bench.rig.taken)
        bench.rig.stubborn = True
        bench.rig.fail(0x2310)
        status = bench.ears.hears('drive', 'drive (node 1) reports emergency 0x2310', 2)
        assert 'since 20' in status.message
        bench.ears.hears('drive', 'the drive is in fault', 2)
        bench.rig.stubborn = False
        wait_for(lambda: bench.rig.status == ENABLED, 'the drive is enabled again')
        bench.ears.hears('drive', 'ok', 0)
        bench.ears.more_samples(20)
        after = [target for _, target, _ in bench.rig.taken[mark + 3:]]
        assert not any(after), 'no old command after a fault'


def test_it_says_which_node_fell_silent_and_recovers_when_it_is_back(bench):
    last = bench.ears.current[-1].sequence
    bench.rig.silent = {2}
    status = bench.ears.hears('nodes', 'load encoder (node 2) is silent: no heartbeat within', 2)
    assert 'since 20' in status.message
    assert bench.rig.taken[-1][1] == 0.0
    wait_for(lambda: bench.rig.status != ENABLED, 'the drive is disabled')
    bench.rig.silent = set()
    bench.ears.hears('nodes', 'ok', 0)
    wait_for(lambda: bench.ears.current[-1].sequence > last + 100, 'the sequence runs on')
    whole = bench.ears.status('rig')
    assert any('is silent' in pair.value for pair in whole.values if pair.key.startswith('past'))


def test_it_tells_an_encoder_that_lost_turns_and_makes_no_speed_of_it(bench):
    begun = len(bench.ears.joint_states)
    wait_for(lambda: len(bench.ears.joint_states) > begun + 3, 'joint states')
    bench.rig.leap = -40.0
    bench.ears.hears('samples', 'the motor encoder leapt by -40 rad', 1)
    begun = len(bench.ears.joint_states)
    wait_for(lambda: len(bench.ears.joint_states) > begun + 3, 'joint states')
    speeds = [abs(state.velocity[0]) for state in bench.ears.joint_states]
    assert np.nanmax(speeds) < 50.0
    bench.rig.leap = 0.0


def test_it_recovers_when_the_rig_restarts(bench):
    last = bench.ears.current[-1]
    bench.rig.close()
    bench.rig = ScriptedRig(bench.channel)
    wait_for(lambda: bench.rig.status == ENABLED, 'the new rig is enabled')
    wait_for(lambda: bench.ears.current[-1].sequence > last.sequence, 'samples come again')
    again = bench.ears.current[-1]
    assert instant(again) - instant(last) == (again.sequence - last.sequence) * PERIOD


def test_it_recovers_when_the_hub_was_killed(bench):
    bench.hub.__exit__()
    bench.ears.hears('bus', 'the bus is gone', 2)
    bench.rig.close()
    bench.hub = CanHub(bench.channel).__enter__()
    bench.rig = ScriptedRig(bench.channel)
    wait_for(lambda: bench.rig.status == ENABLED, 'the drive is enabled again')
    bench.ears.hears('bus', 'ok', 0)


def test_it_refuses_to_be_the_second_driver_and_leaves_the_first_alone(bench):
    with bench.ears.every_sample():
        other = DriverProcess('other', bus__channel=bench.channel, listen_time=5.0)
        status, said = other.wait()
        assert status == 1
        assert 'another driver is on this bus, it sends' in said
        bench.ears.more_samples(20)


def test_it_yields_to_a_driver_that_does_not_listen_and_returns_after_it(bench):
    wire = Wire(open_bus(BusSettings('unix_bus', bench.channel)))
    try:
        wire.send([(0x301, bytes(8))])
        bench.ears.hears('bus', 'another driver is on this bus, it sends drive.rpdo2 (0x301)', 2)
        wait_for(lambda: bench.rig.status != ENABLED, 'the drive is disabled')
    finally:
        wire.bus.shutdown()
    wait_for(lambda: bench.rig.status == ENABLED, 'the drive is enabled again')
    bench.ears.hears('bus', 'ok', 0)
