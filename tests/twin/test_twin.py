"""The lockstep twin: it ..."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from servo_twin.description import servo_file
from servo_twin.lockstep.live_modes import LIVE_MODES
from servo_twin.lockstep.lockstep import Lockstep, Settings
from servo_twin.lockstep.twin import Twin
from servo_twin.physics.servo import ServoError
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import OUTPUTS
from servo_twin.recording.joined_samples import CHANNELS, samples_of
from servo_twin.recording.recording import BALANCES, COLUMNS, COMPARED
from servo_twin.recording.sample_joining import Joiner

PERIOD = 1e-3
BENCH = servo_file.loads("""
servo: bench
drive: {type: current, gain: 0.49, torque_constant: 0.4878}
mechanism: {type: two_inertia, rotor_inertia: 1.14e-4, load_inertia: 5.76, ratio: 161.0,
            stiffness: 5.0e+5, damping: 40.0}
controller: {type: velocity_pi, kp: 16.09, ki: 505.38}
sensors:
  motor_encoder: {noise: 1.8e-4}
  load_encoder: {noise: 2.0e-6}
  torque_sensor: {noise: 0.1}
  current_sensor: {noise: 0.005}
  voltage_sensor: {noise: 0.001}
effects:
  bearing: {effect: coulomb_friction, at: load, level: 20.0}
  grease: {effect: viscous_friction, at: load, slope: 40.0}
""")
FREE = servo_file.loads("""
servo: free
drive: {type: current, gain: 0.49, torque_constant: 0.4878}
mechanism: {type: two_inertia, rotor_inertia: 1.14e-4, load_inertia: 5.76, ratio: 161.0,
            stiffness: 5.0e+5, damping: 40.0}
sensors: {motor_encoder: {}, load_encoder: {}}
""")


def recording(size: int, **columns: object) -> np.ndarray:
    """Return samples of a sine command, all else not measured but what is given."""
    all_of = {name: np.full(size, np.nan) for name in COLUMNS}
    all_of['voltage'] = 2.0 * np.sin(0.02 * np.arange(size))
    all_of |= {name: np.broadcast_to(value, size) for name, value in columns.items()}
    return samples_of(all_of)


def rig(size: int, seed: int = 1, **columns: object) -> np.ndarray:
    """Return samples of a rig like the bench, with noise and a loop that is closed at times."""
    random = np.random.default_rng(seed)
    u = recording(size, **columns)
    y = Twin(BENCH, PERIOD, catch=0.0).step(0, u)
    measured = dict(zip(OUTPUTS, (y + 1e-5 * random.normal(size=y.shape)).T, strict=True))
    del measured['voltage']
    reference = np.where(np.arange(size) % 200 < 120, 0.3, np.nan)
    return recording(size, reference_velocity=reference, **measured, **columns)


def test_it_runs_as_the_kernel_does_over_a_recording_from_rest():
    samples = rig(400)
    twin = Twin(BENCH, PERIOD, catch=0.0)
    columns = dict(zip(CHANNELS, samples.T, strict=True))
    x = initial_state(BENCH, samples[0, CHANNELS.index('motor_position')],
                      samples[0, CHANNELS.index('load_position')],
                      samples[0, CHANNELS.index('torque')])
    assert np.array_equal(twin.step(7, samples), simulate(BENCH, inputs_of(columns), PERIOD, x))


@settings(max_examples=25)
@given(st.sampled_from(LIVE_MODES), st.lists(st.integers(1, 90), min_size=1, max_size=12),
       st.integers(0, 70), st.integers(0, 400))
def test_it_answers_the_same_to_the_last_bit_however_samples_are_cut(mode, sizes, gap, hole):
    samples = rig(480)
    samples[hole:hole + 30, CHANNELS.index('voltage')] = np.nan
    samples[300:310, CHANNELS.index('motor_position')] = np.nan
    numbers = np.arange(480) + np.where(np.arange(480) < 250, 0, gap)
    settings_ = Settings(mode=mode, bridge=40)

    def run(cuts):
        line = Lockstep(BENCH, PERIOD, settings_)
        predictions, residuals = [], []
        for start, end in zip(cuts, cuts[1:], strict=False):
            prediction, due = line.step(int(numbers[start]), 0, samples[start:end])
            predictions.append(prediction.values)
            residuals += [answer.values for answer in due]
        residuals += [answer.values for answer in line.finish()]
        return np.vstack(predictions), np.vstack(residuals), (line.twin.restarts,
                                                              line.twin.bridged)

    cuts = sorted({0, 250, 480, *(c for c in np.cumsum(sizes * 12).tolist() if c < 480)})
    whole, cut = run([0, 250, 480]), run(cuts)
    assert np.array_equal(whole[0], cut[0])
    assert np.array_equal(whole[1], cut[1], equal_nan=True)
    assert whole[2] == cut[2] == ((1, 0) if gap > 40 else (0, gap))
    assert len(whole[1]) == 480


def test_it_takes_up_the_speed_of_a_rig_that_is_already_moving():
    moving = rig(3000)[1500:]
    load = CHANNELS.index('load_position')

    def off(catch):
        y = Twin(BENCH, PERIOD, catch=catch).step(0, moving)
        return np.abs(y[200:, 1] - moving[200:, load]).max()

    assert off(0.1) < 0.2 * off(0.0)


def test_it_is_pulled_by_the_measurements_as_an_observer():
    samples = rig(2000)
    wrong = BENCH.with_values({'effects.bearing.level': 60.0})
    load = CHANNELS.index('load_position')

    def off(mode):
        y = Twin(wrong, PERIOD, mode).step(0, samples)
        return np.abs(y[500:, 1] - samples[500:, load]).max()

    assert off('observer') < 0.1 * off('measured_input')


def test_it_bridges_a_short_gap_with_the_last_input_held():
    samples = recording(300, voltage=1.0)
    through = Twin(BENCH, PERIOD).step(0, samples)
    twin = Twin(BENCH, PERIOD, bridge=50)
    twin.step(0, samples[:200])
    after = twin.step(230, samples[230:])
    assert np.array_equal(after, through[230:])
    assert (twin.bridged, twin.restarts, twin.breaks) == (30, 0, (0,))


def test_it_begins_anew_after_a_long_gap_and_says_why():
    twin = Twin(BENCH, PERIOD, bridge=50)
    twin.step(0, recording(100))
    y = twin.step(151, recording(10, motor_position=16.1, load_position=0.1))
    assert y[0, 1] == 0.1
    assert (twin.bridged, twin.restarts) == (0, 1)
    assert twin.why == '51 samples were missing before 151, at most 50 are bridged'


def test_it_begins_anew_when_the_sequence_goes_back():
    twin = Twin(BENCH, PERIOD)
    twin.step(1000, recording(100))
    fresh = twin.step(0, recording(100))
    assert np.array_equal(fresh, Twin(BENCH, PERIOD).step(0, recording(100)))
    assert twin.restarts == 1 and 'went back from 1099 to 0' in twin.why


def test_it_begins_anew_when_the_state_is_not_finite():
    samples = recording(100, motor_position=0.0, load_position=0.0)
    samples[40, CHANNELS.index('voltage')] = 1e308
    twin = Twin(BENCH, PERIOD)
    y = twin.step(0, samples)
    assert twin.restarts > 0 and 'not finite at sample 4' in twin.why
    assert np.isfinite(y[60:]).all()
    assert 41 in twin.breaks or 42 in twin.breaks


@pytest.mark.parametrize('name', ['voltage', 'external_torque', 'temperature'])
@pytest.mark.parametrize('block', [1, 7, 100])
def test_a_value_that_broke_it_is_not_held(name, block):
    samples = recording(100, motor_position=0.0, load_position=0.0)
    samples[40:, CHANNELS.index(name)] = np.nan
    samples[40, CHANNELS.index(name)] = 1e308
    twin = Twin(BENCH, PERIOD)
    y = np.vstack([twin.step(n, samples[n:n + block]) for n in range(0, 100, block)])
    assert np.isfinite(y[60:]).all() and twin.restarts < 10
    np.testing.assert_array_equal(y, Twin(BENCH, PERIOD).step(0, samples))


def test_it_holds_a_command_that_is_missing():
    whole, holed = recording(200, voltage=1.0), recording(200, voltage=1.0)
    holed[50:90, CHANNELS.index('voltage')] = np.nan
    assert np.array_equal(Twin(BENCH, PERIOD).step(0, whole), Twin(BENCH, PERIOD).step(0, holed))


def test_it_takes_the_rigs_command_while_the_rigs_loop_is_open():
    open_, measured = Twin(BENCH, PERIOD, 'closed_loop'), Twin(BENCH, PERIOD)
    assert np.array_equal(open_.step(0, recording(300)), measured.step(0, recording(300)))
    closed = open_.step(300, recording(1500, reference_velocity=0.2))
    speed = (closed[-1, 1] - closed[-101, 1]) / 0.1
    assert speed == pytest.approx(0.2, rel=1e-2)


def test_it_changes_a_value_from_the_next_sample_on():
    one, two = Twin(BENCH, PERIOD), Twin(BENCH, PERIOD)
    samples = recording(400)
    before, same = one.step(0, samples[:200]), two.step(0, samples[:200])
    two.set({'drive.gain': 0.25}, 'a trial')
    after, other = one.step(200, samples[200:]), two.step(200, samples[200:])
    assert np.array_equal(before, same)
    assert np.array_equal(after[0], other[0]) and not np.array_equal(after[1], other[1])
    assert other[1, 3] == pytest.approx(0.25 * samples[200, CHANNELS.index('voltage')])
    assert two.servo.provenance['drive.gain'].source == 'a trial'


@pytest.mark.parametrize('changes, said', [
    ({'drive.gian': 1.0}, "there is no parameter 'drive.gian'"),
    ({'mechanism.ratio': -1.0}, r'mechanism.ratio = -1 is outside \[0.001, 100000\]'),
    ({'drive.gain': float('nan')}, 'drive.gain = nan A/V is outside'),
])
def test_it_refuses_a_value_that_cannot_be_and_changes_nothing(changes, said):
    twin = Twin(BENCH, PERIOD)
    with pytest.raises(ServoError, match=said):
        twin.set({'drive.torque_constant': 1.0, **changes})
    assert twin.servo is BENCH


def test_it_does_not_jump_when_the_ratio_is_changed():
    twin = Twin(BENCH, PERIOD)
    twin.step(0, recording(200, motor_position=16.1, load_position=0.1))
    before = twin.step(200, recording(200))[-1]
    twin.set({'mechanism.ratio': 160.0})
    after = twin.step(400, recording(1))[0]
    assert np.abs(after - before)[1:4] == pytest.approx([0.0, 0.0, 0.0], abs=5.0)
    assert abs(after[1] - before[1]) < 1e-3


@pytest.mark.long
def test_it_keeps_its_state_when_another_servo_with_the_same_mechanism_is_loaded():
    twin = Twin(BENCH, PERIOD)
    twin.step(0, recording(200))
    assert twin.load(FREE) is True
    y = twin.step(200, recording(1))
    through = Twin(BENCH, PERIOD)
    through.step(0, recording(200))
    assert np.array_equal(y, through.step(200, recording(1)))
    assert twin.restarts == 0


def test_it_refuses_a_servo_without_controller_in_closed_loop():
    twin = Twin(BENCH, PERIOD, 'closed_loop')
    with pytest.raises(ServoError, match='free: closed_loop needs a controller'):
        twin.load(FREE)
    assert twin.servo is BENCH
    with pytest.raises(ServoError, match="there is no mode 'forced_current'"):
        twin.mode = 'forced_current'


def test_it_publishes_one_residual_for_each_block_with_the_same_numbers():
    line = Lockstep(BENCH, PERIOD, Settings(window=0.02))
    samples, seen = rig(400), []
    for start in range(0, 400, 7):
        prediction, due = line.step(start, 1000 * start, samples[start:start + 7])
        assert (prediction.sequence, prediction.stamp) == (start, 1000 * start)
        seen += due
    assert len(seen) == 55  # the last 10 samples, and what shares a block with them, are owed
    seen += line.finish()
    assert [answer.sequence for answer in seen] == list(range(0, 400, 7))
    assert all(answer.stamp == 1000 * answer.sequence for answer in seen)
    assert seen[5].values.shape == (7, len(COMPARED) + len(BALANCES))


def test_it_joins_topics_by_number_and_never_by_arrival():
    joiner = Joiner(('a', 'b'))
    arrivals = [('a', 0), ('a', 1), ('a', 2), ('b', 0), ('b', 2), ('a', 3), ('b', 3)]
    joined = [joiner.put(topic, number, f'{topic}{number}') for topic, number in arrivals]
    assert [parts for parts in joined if parts] == [
        {'a': 'a0', 'b': 'b0'}, {'a': 'a2', 'b': 'b2'}, {'a': 'a3', 'b': 'b3'}]
    assert joiner.given_up == 1


def test_it_forgets_what_waits_of_a_topic_that_begins_anew():
    joiner = Joiner(('a', 'b'))
    joiner.put('a', 5, 'old')
    assert joiner.put('a', 0, 'new') is None
    assert joiner.put('b', 0, 'b') == {'a': 'new', 'b': 'b'}
    assert joiner.put('b', 5, 'b') is None
