"""A twin beside an encoder that is reset, loses turns or slips: it ..."""

from itertools import pairwise
from math import tau
import re

import numpy as np
import pytest
from test_twin import BENCH, PERIOD, rig

from servo_twin.lockstep.lockstep import Lockstep, Settings
from servo_twin.recording.joined_samples import CHANNELS
from servo_twin.recording.recording import BALANCES, COMPARED

MOTOR, LOAD = (CHANNELS.index(f'{side}_position') for side in ('motor', 'load'))
WINDOW = 40


def most(balances):
    """Return the largest value of each balance."""
    return np.nanmax(np.abs(np.vstack([np.zeros(len(BALANCES)), balances])), axis=0)


def answered(samples, cuts=(), hole=None):
    """
    Return (predictions, balances, lockstep) of samples that came in blocks.

    Before row ``hole`` 60 samples are missing, more than are bridged.
    """
    line = Lockstep(BENCH, PERIOD, Settings())
    told, balances = [], []
    for start, end in pairwise(sorted({0, *cuts, len(samples), *([hole] if hole else [])})):
        number = start + 60 if hole and start >= hole else start
        prediction, due = line.step(number, 0, samples[start:end])
        told.append(prediction.values)
        balances += [one.values[:, len(COMPARED):] for one in due]
    balances += [one.values[:, len(COMPARED):] for one in line.finish()]
    return np.vstack(told), np.vstack(balances), line


@pytest.mark.parametrize('column,size', [(MOTOR, 3.0 * tau), (MOTOR, -1000.0), (LOAD, tau),
                                         (LOAD, -0.3)])
def test_it_begins_again_where_an_encoder_leaps_and_blames_no_balance_for_it(column, size):
    clean = rig(1000)
    leapt = clean.copy()
    leapt[500:, column] += size
    _, before, _ = answered(clean)
    _, balances, line = answered(leapt)
    name = 'motor encoder' if column == MOTOR else 'load encoder'
    assert line.twin.restarts == 1
    told = re.match(rf'the {name} leapt by (\S+) rad \(\S+ turns\): it was', line.twin.why)
    assert float(told[1]) == pytest.approx(size, rel=1e-3, abs=0.05)
    unknown = (np.isnan(balances) & ~np.isnan(before)).any(axis=1)
    assert 0 < unknown.sum() <= 2 * WINDOW
    begun = most(answered(clean, hole=503)[1])  # as after any break
    for b, what in enumerate(BALANCES):
        assert most(balances)[b] <= 1.5 * begun[b] + 1.0, what
    transmission = BALANCES.index('transmission')
    assert most(balances)[transmission] <= 1.2 * most(before)[transmission]


def test_it_leaves_out_what_slips_for_a_sample_and_goes_on():
    clean = rig(600)
    slipped = clean.copy()
    slipped[[200, 301, 302], MOTOR] += [50.0, -70.0, 1e9]
    predictions, balances, line = answered(slipped)
    assert line.twin.restarts == 0 and line.screen.left_out == 3
    assert np.array_equal(predictions, answered(clean)[0])
    assert np.nanmax(np.abs(balances)) <= np.nanmax(np.abs(answered(clean)[1]))


@pytest.mark.parametrize('seed', range(8))
def test_it_answers_alike_to_the_last_bit_however_leaps_and_slips_are_cut(seed):
    random = np.random.default_rng(seed)
    samples = rig(500)
    for row in random.integers(20, 480, size=6):
        samples[row:, random.choice([MOTOR, LOAD])] += random.choice([-30.0, tau, 500.0])
    for row in random.integers(20, 480, size=6):
        samples[row:row + random.integers(1, 4), MOTOR] = random.choice([np.nan, 1e6, -40.0])
    whole = answered(samples)
    for size in (1, 7, 64):
        cut = answered(samples, range(size, 500, size))
        assert np.array_equal(cut[0], whole[0], equal_nan=True)
        assert np.array_equal(cut[1], whole[1], equal_nan=True)
        assert cut[2].twin.restarts == whole[2].twin.restarts > 0


def test_a_rig_that_already_turns_or_hits_a_stop_has_no_encoder_that_leaps():
    moving = rig(800)[400:]
    moving[:, MOTOR] += 900.0 * PERIOD * np.abs(np.arange(400) - 200.0)
    moving[:, LOAD] += 30.0 * PERIOD * np.abs(np.arange(400) - 200.0)
    _, _, line = answered(moving)
    assert line.twin.restarts == 0 and line.screen.left_out == 0
