"""The online estimator on laws that are known, and on a gearbox that warms up: it ..."""

from pathlib import Path

from hypothesis import given, strategies
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.commands.online import followed, in_windows
from servo_identify.watch.estimator.online_estimator import OnlineEstimator
from servo_identify.watch.estimator.recursive_least_squares import Tracker
from servo_identify.watch.estimator.reversals import Reversals
from servo_twin.bag import read_recording
from servo_twin.description import servo_file
from servo_twin.recording.joined_samples import CHANNELS, samples_of

EXAMPLE = Path(__file__).resolve().parents[2] / 'docs' / 'example'
CONFIG = Path(__file__).resolve().parents[2] / 'config'
SERVO = CONFIG / 'servos' / 'rv_bench.yaml'
PERIOD = 1e-3
INFINITE = (-1e9, 1e9)


def known_motion(seconds, level=20.0, slope=15.0, gain=0.49):
    """Return the samples of the bench's machine under a friction that is known, no noise."""
    servo = servo_file.load(SERVO)
    v = servo.values
    t = np.arange(round(seconds / PERIOD)) * PERIOD
    w = 2.0 * np.pi * 0.25
    angle, speed, rise = np.sin(w * t) / w, np.cos(w * t), -w * np.sin(w * t)
    torque = (v['mechanism.load_inertia'] * rise + level * np.sign(speed) + slope * speed + 5.0)
    motor = 161.0 * angle
    current = np.full(len(t), 1.0)
    columns = {'motor_position': motor, 'load_position': angle, 'torque': torque,
               'external_torque': np.full(len(t), 5.0), 'current': current,
               'voltage': current / gain}
    nothing = np.full(len(t), np.nan)
    return servo, samples_of({name: nothing for name in CHANNELS} | columns)


def test_it_finds_level_slope_and_gain_of_a_known_law():
    servo, samples = known_motion(20.0)
    estimator = OnlineEstimator(servo, PERIOD, 10.0)
    assert estimator.names == ('effects.coulomb.level', 'effects.viscous.slope', 'drive.gain')
    for at in range(0, len(samples), 37):
        estimator.push(at, samples[at:at + 37])
    known = estimator.snapshot()
    assert known.values == pytest.approx([20.0, 15.0, 0.49], rel=2e-3)
    assert not known.bounded.any() and (known.rows > 50).all()


def test_it_learns_nothing_at_rest_and_nothing_of_samples_that_are_missing():
    servo, samples = known_motion(5.0)
    samples[:, :] = samples[0]
    estimator = OnlineEstimator(servo, PERIOD)
    estimator.push(0, samples)
    assert estimator.snapshot().rows.tolist()[:2] == [0, 0]
    _, samples = known_motion(5.0)
    samples[:, :] = np.nan
    estimator.push(9000, samples)
    assert estimator.snapshot().rows.tolist()[:2] == [0, 0]


def test_it_stays_within_the_bounds_and_says_so():
    servo, samples = known_motion(10.0, level=80.0)
    estimator = OnlineEstimator(servo, PERIOD)
    estimator.push(0, samples)
    known = estimator.snapshot()
    assert known.values[0] == servo.tolerance['effects.coulomb.level'][1] == 60.0
    assert known.bounded.tolist()[0] and not known.bounded[2]


@given(strategies.integers(0, 10_000))
def test_it_is_as_sure_as_it_may_be(seed):
    random = np.random.default_rng(seed)
    tracker = Tracker([0.0, 0.0], [10.0, 10.0], [INFINITE] * 2, 1.0)
    for _ in range(400):
        row = [1.0, random.standard_normal()]
        tracker.take(row, 3.0 - 2.0 * row[1] + 0.5 * random.standard_normal(), 1.0, 100.0)
    assert (abs(tracker.values - [3.0, -2.0]) < 5.0 * tracker.std).all()
    assert (tracker.std < 0.2).all() and (tracker.std > 0.01).all()


def test_it_forgets_in_the_time_that_it_was_told():
    tracker = Tracker([0.0], [10.0], [INFINITE], 0.1)
    for k in range(400):
        tracker.take([1.0], 1.0 if k < 200 else 2.0, 1.0, 50.0)
        if k == 249:
            assert tracker.values[0] == pytest.approx(2.0 - np.exp(-1.0), abs=0.03)
    assert tracker.values[0] == pytest.approx(2.0, abs=0.03)


def test_it_keeps_what_no_row_speaks_of():
    tracker = Tracker([0.0, 0.0], [10.0, 10.0], [INFINITE] * 2, 0.1)
    for k in range(100):
        tracker.take([1.0, k % 3], 1.0 + 4.0 * (k % 3), 1.0, 20.0)
    sure = tracker.std[1]
    for _ in range(5000):
        tracker.take([1.0, 0.0], 1.5, 1.0, 20.0)
    assert tracker.values == pytest.approx([1.5, 4.0], abs=0.1)
    assert np.isfinite(tracker.std).all() and tracker.std[1] < 10.0 * sure + 1.0


def test_it_measures_the_play_at_each_reversal():
    t = np.arange(0.0, 4.0, PERIOD)
    torque = 30.0 * np.sin(2.0 * np.pi * t)
    found = Reversals(PERIOD, 4.0).take(2e-4 * np.sign(torque), torque, np.zeros(len(t)))
    assert found == pytest.approx([4e-4] * 7)
    assert Reversals(PERIOD, 4.0).take(2e-4 * np.sign(torque), torque, t) == []


@pytest.mark.slow
def test_it_follows_a_gearbox_that_warms_up(tmp_path, capsys):
    words = ['experiment', 'slow_reversals', '--speeds', '1.0', '--duration', '120', '--headless',
             '--set', 'thermal.capacity=40', '-o', str(tmp_path)]
    assert main(words) == 0
    bag = tmp_path / 'slow_reversals'
    recording = read_recording(bag)
    assert recording['temperature'][-100:].mean() > recording['temperature'][:100].mean() + 8.0
    servo = servo_file.load(SERVO)
    known = followed(servo, recording, 15.0, 1.0)
    windows = in_windows(servo, recording, 20.0)
    slope = windows[0].names.index('effects.viscous.slope')
    assert windows[-1].values[slope] < 0.85 * windows[0].values[slope]
    for window in windows[1:]:
        now = min(known, key=lambda s: abs(s.sequence - window.sequence))
        assert abs(now.values - window.values)[:2] == pytest.approx([0.0, 0.0], abs=1.5)
        assert (abs(now.values - window.values) < 4.0 * now.std)[:2].all()
    assert main(['online', str(bag), '--servo', str(SERVO), '-o', str(tmp_path / 'on')]) == 0
    assert 'effects.viscous.slope: ' in capsys.readouterr().out
    assert (tmp_path / 'on' / 'online.png').stat().st_size > 10_000
    assert (tmp_path / 'on' / 'online.csv').read_text().startswith('t,effects.coulomb.level,')


def example(path, **changes):
    """Write a recording of the docs with other columns, None for those that are left out."""
    rows = np.genfromtxt(EXAMPLE / 'runs' / 'multisine_1.csv', delimiter=',', skip_header=1)
    names = ('t', 'voltage', 'current', 'motor_position', 'load_position')
    columns = {**dict(zip(names, rows.T, strict=True)), **changes}
    kept = {name: column for name, column in columns.items() if column is not None}
    np.savetxt(path, np.stack(list(kept.values()), 1), delimiter=',', header=','.join(kept),
               comments='')
    return ['online', str(path), '--servo', str(EXAMPLE / 'fan.yaml'), '-o',
            str(path.with_suffix(''))], columns


def test_it_says_which_channel_lacks(tmp_path, capsys):
    assert main(example(tmp_path / 'a.csv', current=None)[0]) == 1
    said = capsys.readouterr().out
    assert 'it needs current, which was not recorded' in said and 'not excited' not in said


def test_it_says_of_a_pattern_that_it_follows_one_recording(tmp_path, capsys):
    pattern = str(EXAMPLE / 'runs' / 'multisine_*.csv')
    assert main(['online', pattern, '--servo', str(EXAMPLE / 'fan.yaml'), '-o',
                 str(tmp_path / 'on')]) == 2
    assert 'names 3 files, and online takes one' in capsys.readouterr().err


def test_it_warns_of_what_the_check_finds_red(tmp_path, capsys):
    words, columns = example(tmp_path / 'a.csv')
    assert main(words) == 0 and 'warning' not in capsys.readouterr().err
    main(example(tmp_path / 'b.csv', current=1e3 * columns['current'])[0])
    assert 'warning: a factor of 1/1000 on current' in capsys.readouterr().err


def test_it_tracks_nothing_of_a_servo_that_has_nothing_to_track():
    bare = servo_file.loads(SERVO.read_text().partition('\neffects:')[0])
    assert OnlineEstimator(bare, PERIOD).names == ('drive.gain',)
    text, noise = SERVO.read_text().partition('\neffects:')[0], '  current_sensor:'
    blind = servo_file.loads('\n'.join(line for line in text.splitlines()
                                       if not line.startswith(noise)))
    assert OnlineEstimator(blind, PERIOD).names == ()
    assert OnlineEstimator(blind, PERIOD).snapshot().values.shape == (0,)
