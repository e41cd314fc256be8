"""What a diagnosis computes once and keeps, and what it keeps no longer than it needs."""

from dataclasses import replace
from pathlib import Path

import numpy as np

import servo_identify as si
from servo_identify.diagnose.handover import trial
from servo_identify.diagnose.mechanisms.hypothesis import Columns
from servo_identify.diagnose.selection.bounded_least_squares import bounded, every_least
from servo_identify.diagnose.selection.candidate_gains import Leavings
from servo_identify.diagnose.selection.regression import Sums
from servo_identify.fit.segments import courses_of
from servo_identify.fit.shooting import Shooting

EXAMPLE = Path(__file__).resolve().parents[2] / 'docs' / 'example'


def test_a_point_that_was_rolled_is_not_rolled_again(monkeypatch):
    servo = si.load_servo(EXAMPLE / 'fan.yaml')
    data = list(si.read(EXAMPLE / 'runs' / 'multisine_1.csv', servo))
    shooting = Shooting(servo.servo, courses_of(servo.servo, data, 'measured_input', 1.0),
                        'measured_input')
    rolled, roll = [], shooting._roll
    monkeypatch.setattr(shooting, '_roll', lambda *job: rolled.append(job) or roll(*job))
    point = shooting.beginning(servo.servo.theta)
    other = replace(point, zeros=point.zeros + 1e-4)
    first = shooting.simulate([point, other])
    again = shooting.simulate([other, replace(point, starts=point.starts + 1e-3), point])
    shooting.close()
    assert len(rolled) == 3
    assert np.array_equal(first[0][0], again[2][0], equal_nan=True)
    assert np.array_equal(first[1][0], again[0][0], equal_nan=True)


def test_a_file_is_simulated_once_however_often_its_gap_is_asked_for(monkeypatch):
    servo = si.load_servo(EXAMPLE / 'fan.yaml').servo
    data = list(si.read(EXAMPLE / 'runs' / 'multisine_1.csv', si.load_servo(EXAMPLE / 'fan.yaml')))
    run, simulate = [], trial.simulated
    monkeypatch.setattr(trial, 'simulated', lambda *job: run.append(job) or simulate(*job))
    one = trial.Trial(data, list(data))
    changed = replace(servo, values={**servo.values, 'mechanism.load_inertia':
                                     2.0 * servo.numbers['mechanism.load_inertia']})
    gaps = [one.gap(some) for some in (servo, replace(servo), changed)]
    assert len(run) == 2
    assert gaps[0] is gaps[1]
    assert gaps[2].total() != gaps[0].total()


def test_packed_columns_hold_the_samples_that_move_and_give_all_back():
    table = np.zeros((50, 3))
    table[10:20, :2] = np.random.default_rng(0).normal(size=(10, 2))
    packed = Columns(table).packed()
    assert packed.table.shape == (10, 3)
    assert np.array_equal(packed.whole(), table)
    some = np.array([45, 12, 3, 19])
    assert np.array_equal(packed.at(some), table[some])
    assert np.array_equal(packed.only(np.array([1])).whole(), table[:, [1]])
    assert packed.summed().size == 3


def _problem(unknowns=6):
    chance = np.random.default_rng(1)
    table = chance.normal(size=(80, 1 + unknowns))
    low, high = np.full(unknowns, -0.05), np.full(unknowns, 0.05)
    return table.T @ table, low, high, chance.uniform(0.0, 5.0, unknowns)


def test_a_guess_leads_to_the_same_least_squares():
    gram, low, high, prior = _problem()
    inner = gram[1:, 1:] + np.diag(prior)
    plain = bounded(inner, gram[1:, 0].copy(), low, high)
    assert (np.abs(plain) == 0.05).any()  # some unknowns are held at a bound
    for near in (plain, np.zeros(6), high):
        found = every_least(np.stack((gram, 2.0 * gram)), prior, low, high, near, True)
        assert np.allclose(found[0], plain, rtol=1e-7, atol=1e-12)


def test_what_a_candidate_leaves_is_that_of_its_best_values():
    gram, low, high, prior = _problem()
    where = [np.array([0, 1, -1, 2, -1, -1, 3]), np.arange(7)]
    tables = {0: gram[np.ix_([0, 1, 3, 6], [0, 1, 3, 6])], 1: gram}
    floor, count = np.array([1.0, 1e6]), np.array([30.0, 50.0])
    sums = Sums(gram, np.zeros((2, 7)), [])
    leavings = Leavings.of(sums, np.append(0.0, prior), tables, where, floor, count)
    columns = np.array([0, 2, 6])
    values = np.append(1.0, bounded(gram[np.ix_([2, 6], [2, 6])] + np.diag(prior[[1, 5]]),
                                    gram[[2, 6], 0], low[:2], high[:2]))
    some = values[[0, 2]]  # the first equation does not know column 2
    square = some @ gram[np.ix_([0, 6], [0, 6])] @ some
    wanted = 15.0 * np.log(square) + 25.0 * np.log(1e6)  # the second is below its floor
    assert np.isclose(leavings.left(columns, values), wanted)
    left, found = leavings.fitted(columns, low[:2], high[:2], np.zeros(2))
    assert np.isclose(left, wanted) and np.allclose(found, values[1:])
