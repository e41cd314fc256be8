"""The change detector on residuals whose statistics are known: it ..."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

from servo_identify.cli import main
from servo_identify.watch.changes.change_detector import ChangeDetector, Settings

PERIOD = 0.02
LEARN = 60.0


def noise(seed, seconds, memory=0.0, columns=2):
    """Return unit noise, (n, columns), each sample a share ``memory`` of the one before."""
    white = np.random.default_rng(seed).standard_normal((round(seconds / PERIOD), columns))
    return lfilter([np.sqrt(1.0 - memory ** 2)], [1.0, -memory], white, axis=0)


def detector(false_alarms, **more):
    return ChangeDetector(('motor', 'load'), PERIOD, Settings(
        learn=LEARN, false_alarms=false_alarms, **{'least': 0.0} | more))


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('memory', [0.0, 0.9, 0.98])
def test_it_keeps_the_stated_rate_of_false_alarms_on_autocorrelated_noise(memory):
    rate, seconds, streams = 6.0, 150.0, 20
    alarmed = 0
    for seed in range(streams):
        watch = detector(rate)
        alarmed += bool(watch.push(0, noise(seed, LEARN + seconds, memory)))
        assert watch.state == 'watching'
    expected = 1.0 - np.exp(-rate / 3600.0 * seconds)
    assert alarmed < streams * (expected + 3.0 * np.sqrt(expected / streams))


@pytest.mark.parametrize(('column', 'change'), [
    (1, lambda rows: rows + 1.5), (0, lambda rows: rows - 1.5), (1, lambda rows: 3.0 * rows)])
def test_it_names_the_balance_that_changed_within_seconds(column, change):
    watch = detector(0.1)
    rows = noise(5, 150.0, 0.9)
    switched = round(100.0 / PERIOD)
    rows[switched:, column] = change(rows[switched:, column])
    found = []
    for at in range(0, len(rows), 10):
        found += watch.push(at, rows[at:at + 10])
        if found:
            break
    assert [alarm.balance for alarm in found] == [watch.balances[column]]
    assert 0.0 < (found[0].sequence - switched) * PERIOD < 30.0
    assert found[0].sequence - found[0].since <= 128 * watch.size


def test_it_says_an_alarm_once_until_it_learns_anew():
    watch = detector(0.1)
    rows = noise(6, 200.0)
    rows[4000:] += 3.0
    found = watch.push(0, rows)
    assert {alarm.balance for alarm in found} == {'motor', 'load'} == set(watch.alarms)
    assert len(found) == 2
    watch.relearn()
    assert (watch.state, watch.alarms, watch.learned) == ('learning', {}, 0.0)
    assert watch.push(10_000, rows[5000:]) == []


@pytest.mark.long
def test_it_takes_out_what_an_imperfect_twin_owes_to_the_motion():
    """At the stated rate one stream in a hundred has a false change: two of five are too many."""
    time = np.arange(round(400.0 / PERIOD)) * PERIOD
    speed = np.sin(2.0 * np.pi * time / 7.3)[:, None]
    assert sum(bool(detector(0.1).push(0, noise(seed, 400.0, 0.9) + 20.0 * speed, speed))
               for seed in range(5, 10)) <= 1
    watch, rows = detector(0.1), noise(7, 400.0, 0.9)
    rows[15_000:] += 2.0
    found = watch.push(0, rows + 20.0 * speed, speed)
    assert found and 15_000 < found[0].sequence < 15_500


def moves(seed, seconds):
    """Return speed and direction, (n, 2), of moves between rests, and the begin of each part."""
    random, speed, begins = np.random.default_rng(seed), [], []
    while sum(map(len, speed)) * PERIOD < seconds:
        for top in (random.uniform(0.5, 1.0) * random.choice([-1.0, 1.0]), 0.0):
            begins.append(sum(map(len, speed)))
            speed.append(np.full(round(random.uniform(1.0, 3.0) / PERIOD), top))
    speed = np.concatenate(speed)
    return np.column_stack([speed, np.sign(speed)]), begins


@pytest.mark.parametrize('seed', [4, 5])
def test_it_takes_moves_that_each_err_in_their_own_way_for_no_change(seed):
    driven, begins = moves(seed, 300.0)
    rows = noise(seed, len(driven) * PERIOD, columns=2)
    own = np.random.default_rng(100 + seed).standard_normal(len(begins))
    rows[:, 1] += np.repeat(own, np.diff([*begins, len(rows)]))
    assert detector(0.1).push(0, rows, driven) == []


def test_it_does_not_judge_a_rig_that_is_driven_as_never_seen():
    rows, speed = noise(8, 200.0), np.ones((10_000, 1))
    speed[6000:] = 5.0
    rows[6000:] += 10.0
    watch = detector(0.1)
    assert watch.push(0, rows, speed) == []
    assert watch.passed_over > 200


def test_it_passes_over_a_change_that_is_too_small_to_matter():
    rows = noise(11, 400.0)
    rows[8000:] += 0.6
    assert detector(0.1).push(0, rows) != []
    assert detector(0.1, least=2.0).push(0, rows) == []


def test_it_lets_pass_what_is_unknown_and_begins_anew_after_a_gap():
    rows = noise(9, 200.0)
    rows[:, 0] = np.nan
    rows[5000:5200] = np.nan
    watch = detector(0.1)
    watch.push(0, rows[:9000])
    assert watch.push(9500, rows[9500:]) == []
    assert watch.state == 'watching' and watch.alarms == {}


def test_it_answers_alike_however_the_samples_are_cut():
    rows = noise(10, 120.0, 0.9)
    rows[5000:, 1] += 2.0
    one, other = detector(1.0), detector(1.0)
    found = [alarm for at in range(0, len(rows), 7) for alarm in other.push(at, rows[at:at + 7])]
    assert one.push(0, rows) == found != []


def test_it_refuses_settings_that_make_no_sense():
    with pytest.raises(ValueError, match='false_alarms = 0; it must be positive'):
        Settings(false_alarms=0.0)
    with pytest.raises(ValueError, match='learn = 5 s holds fewer than 30 blocks'):
        Settings(learn=5.0)


def test_its_command_measures_the_seconds_to_an_alarm_and_the_rate_of_false_ones(tmp_path, capsys):
    assert main(['watch', '-o', str(tmp_path), '--effects', 'withheld.drive_gain', '--learn', '12',
                 '--wait', '6', '--hours', '0']) == 0
    said = capsys.readouterr().out
    assert '1 of 1 named rightly first' in said and '; in: drive (gain, ' in said
    told = json.loads((tmp_path / 'watch.json').read_text())
    effect, = told['effects']
    assert (effect['balance'], effect['too_early']) == ('drive', False)
    assert list(effect['places']) == ['drive'] and 0.95 <= effect['places']['drive'] <= 1.0
    assert effect['place'].startswith('drive (gain, ')
    assert 0.0 < effect['seconds'] < 5.0 and told['hours_watched'] == 0.0
    assert (tmp_path / 'watch.png').stat().st_size > 3000
    assert main(['watch', '-o', str(tmp_path), '--effects', 'luck']) == 2
    assert "['luck'] cannot be switched on here" in capsys.readouterr().err


@pytest.mark.parametrize('given', [['run.csv'], ['run_1.csv', 'run_2', '-o', 'new', '--servo',
                                                 'rv_bench']])
def test_it_says_which_commands_take_recordings(capsys, given):
    with pytest.raises(SystemExit):
        main(['watch', *given])
    said = capsys.readouterr().err
    assert f"'{given[0]}': watch takes none" in said and '`servo-identify check` says' in said
