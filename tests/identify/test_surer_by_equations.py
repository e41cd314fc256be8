"""Values that the equations know better than a simulation that drifts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic_recordings import PERIOD, sampled
from test_one_motor import HOBBY
from test_selection import SERVO, with_effect

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.handover.added import Added
from servo_identify.diagnose.handover.held_values import surer
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed


def steps(rig, seed, size=2.5, lost=0.0):
    """Return an open-loop recording of steps of two sizes; a bridge loses volts by its current."""
    time = np.arange(5000) * PERIOD
    command = size * np.sign(np.sin(2.0 * np.pi * (0.7 + 0.05 * seed) * time + seed))
    command *= 1.0 + 0.4 * np.sign(np.sin(2.0 * np.pi * 0.23 * time))
    one = sampled(rig, command, seed=seed)
    asked = command + lost * np.sign(one.columns['current'])
    return replace(one, name=f'steps_{seed}', family='steps',
                   columns=one.columns | {'voltage': asked})


def answer_of(rig, servo=SERVO, **how):
    first, second, third = (steps(rig, seed, **how) for seed in (1, 2, 3))
    return diagnose([first], servo, [second], [third])


@pytest.mark.long
def test_volts_that_a_bridge_loses_come_out_whole_though_the_current_jumps():
    disc = HOBBY.with_values({'mechanism.rotor_inertia': 5e-3})
    report = answer_of(disc, disc, lost=0.5).report
    assert [(one.effect, one.site) for one in report.which] == [('drive_dead_band', 'current')]
    assert np.max(np.abs(report.which[0].curve['y'])) == pytest.approx(0.5, rel=0.05)
    assert report.gap['solved'] > 0.8


@pytest.mark.long
def test_a_payload_keeps_the_size_and_frequency_of_the_equations():
    numbers = SERVO.numbers
    swings = 0.1 * numbers['mechanism.load_inertia']
    rig = with_effect('payload_resonance', 'load', inertia=swings, frequency=9.0, damping=0.03)
    answer = answer_of(rig)
    assert [one.effect for one in answer.report.which] == ['payload_resonance']
    found = answer.augmented.numbers
    assert found['effects.payload_resonance.inertia'] == pytest.approx(swings, rel=0.1)
    assert found['effects.payload_resonance.frequency'] == pytest.approx(9.0, rel=0.03)


@pytest.mark.parametrize(('doubt', 'held'), [(0.5, True), (0.01, False)])
def test_the_travel_of_a_loop_is_held_where_its_level_is(doubt, held):
    """A fit that does not know the level may take the travel of that level to nothing."""
    level, travel = (f'effects.loop.{name}' for name in ('level', 'travel'))
    loop = Added(None, (Placed('loop', find('hysteresis'), 'mesh'),),
                 {level: 0.8, travel: 3e-3}, (level, travel), stds={level: 0.1, travel: 8e-4})
    fit = SimpleNamespace(values={level: 0.7, travel: 1e-5},
                          std_within={level: doubt, travel: 1e-5})
    assert surer(loop, fit).fitted == (() if held else (level, travel))


@pytest.mark.parametrize(('doubt', 'held'), [(0.2, True), (1e-3, False)])
def test_how_sure_an_amplitude_is_holds_for_the_shape_that_was_searched_alone(doubt, held):
    """Equations that stopped at another time constant are no surer of the stiffness beside it."""
    stiffness, time = (f'effects.fading.{name}' for name in ('stiffness', 'time'))
    fading = Added(None, (Placed('fading', find('relaxing_spring'), 'load'),),
                   {stiffness: 54.0, time: 0.5}, (stiffness, time), stds={stiffness: 1.5})
    fit = SimpleNamespace(values={stiffness: 57.0, time: 0.2},
                          std_within={stiffness: 4.0, time: doubt})
    assert surer(fading, fit).fitted == (() if held else (stiffness, time))
