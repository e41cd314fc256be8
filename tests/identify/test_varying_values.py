"""Values that vary with angle, time, quadrant or far from the file: named as what they are."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recordings import PERIOD, sampled
from test_selection import diagnosed, named_by_equations, recorded, SERVO, with_effect, without

from servo_identify.diagnose.diagnose import diagnose
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import OUTPUTS
from servo_twin.recording.recording import COLUMNS, Recording

LEVER = 0.3 * SERVO.numbers['mechanism.load_inertia']


def turning(rig, seed):
    """Return a recording in which the load makes a whole turn."""
    time = np.arange(8000) * PERIOD
    command = sum(5.0 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.25, 0.9, 2.1))
    return replace(sampled(rig, command, seed=seed), name=f'turn_{seed}', family='turn')


@pytest.mark.long
@pytest.mark.slow
def test_an_inertia_that_varies_over_the_turn_is_the_loads_and_comes_with_its_law():
    rig = with_effect('linked_inertia', 'load', order=2.0, cosine=(LEVER,), sine=(0.5 * LEVER,))
    first, second, third = (turning(rig, seed) for seed in (1, 2, 3))
    answer = diagnose([first], SERVO, [second], [third])
    (one,) = answer.report.which
    assert (one.effect, one.site) == ('parameter:load_inertia', 'load')
    assert 'another value of load inertia at each angle of the load (amplitude' in (
        answer.report.verdict['sentence'])
    (added,) = (p for p in answer.augmented.effects if p.effect.name == 'linked_inertia')
    values = answer.augmented.values
    assert values[f'effects.{added.name}.order'] == 2.0
    assert values[f'effects.{added.name}.cosine'][0] == pytest.approx(LEVER, rel=0.1)
    assert values[f'effects.{added.name}.sine'][0] == pytest.approx(0.5 * LEVER, rel=0.1)
    assert answer.report.gap['solved'] > 0.8


def looped(rig, seed, fed=0.0):
    """Return a recording of a rig in its loop; ``fed`` V s2/rad times the reference is added."""
    time = np.arange(6000) * PERIOD
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['reference_velocity'] = sum(0.2 * np.sin(2.0 * np.pi * f * time + seed)
                                        for f in (0.4, 1.1, 2.9))
    added = fed * np.gradient(columns['reference_velocity'], PERIOD)
    y = simulate(rig, inputs_of({**columns, 'added_command': added}), PERIOD,
                 initial_state(rig, 0.0, 0.0), 'closed_loop')
    columns |= dict(zip(OUTPUTS, y.T, strict=True))
    return Recording(f'loop {seed}', PERIOD, {n: np.ascontiguousarray(c) for n, c in
                                              columns.items()}, family='loop',
                     digest=f'{seed:064d}')


def carrying(seed):
    """Return a recording of a load whose inertia grows by a third as another axis turns."""
    time = np.arange(8000) * PERIOD
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['voltage'] = sum(2.0 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f)
                             for f in (0.25, 0.9, 2.1))
    columns['coupled_position'] = np.pi * np.clip(time / 4.0 - 0.5, 0.0, 1.0)
    y = simulate(CARRIES, inputs_of(columns), PERIOD, initial_state(CARRIES, 0.0, 0.0))
    chance = np.random.default_rng(seed)
    for name, series in zip(OUTPUTS[:4], y.T, strict=False):
        columns[name] = series + SERVO.noise(name) * chance.standard_normal(len(time))
    return Recording(f'carries {seed}', PERIOD, columns, family='turn', digest=f'{seed:064d}')


CARRIES = with_effect('coupled_inertia', 'load', cosine=-0.5 * LEVER, order=1.0)


@pytest.mark.long
@pytest.mark.slow
def test_an_inertia_that_another_axis_moves_is_known_by_its_position_or_drifts():
    several = [carrying(seed) for seed in (1, 2)]
    assert named_by_equations(several, CARRIES) == set()
    blind = [without(one, 'coupled_position') for one in several]
    assert named_by_equations(blind) == {('parameter:load_inertia', 'load')}


@pytest.mark.long
@pytest.mark.slow
def test_viscous_friction_that_fades_is_friction_that_drifts():
    rig = with_effect('viscous_drift', 'load', excess=25.0, settling=2.0)
    answer = diagnosed(rig)
    assert [(one.effect, one.site) for one in answer.report.which] == [('friction_drift', 'load')]
    (added,) = (p for p in answer.augmented.effects if p.name not in {
        known.name for known in SERVO.effects})
    assert added.effect.name == 'viscous_drift'
    assert not answer.augmented.values[f'effects.{added.name}.slope']  # by a temperature: none is
    assert answer.augmented.values[f'effects.{added.name}.excess'] == pytest.approx(25.0, rel=0.2)


@pytest.mark.long
@pytest.mark.slow
def test_a_filter_of_the_controller_far_from_the_files_is_the_controllers():
    far = {'controller.kp': 6.0, 'controller.ki': 40.0, 'controller.filter': 0.01}
    answer = diagnose([looped(SERVO.with_values(far), seed) for seed in (1, 2, 3)], SERVO)
    assert [one.effect for one in answer.report.which] == ['controller_mismatch']
    for path, value in far.items():
        assert answer.augmented.numbers[path] == pytest.approx(value, rel=0.02)


@pytest.mark.long
@pytest.mark.slow
def test_an_acceleration_that_a_firmware_feeds_forward_is_the_controllers():
    report = diagnose([looped(SERVO, seed, fed=0.3) for seed in (1, 2, 3)], SERVO).report
    assert [one.effect for one in report.which] == ['controller_mismatch']
    assert report.which[0].change.startswith('it adds 0.3')


@pytest.mark.long
@pytest.mark.slow
def test_teeth_that_rub_more_where_the_load_drives_are_one_friction():
    weight = Placed('weight', find('gravity'), 'load')
    known = SERVO.with_effects(weight, values=weight.paths({'cosine': 0.0, 'sine': -60.0}))
    rubs = Placed('rubs', find('load_dependent_friction'), 'load')
    rig = known.with_effects(rubs, values=rubs.paths({'share': 0.1, 'back_driven': 0.3}))
    first, second, third = (recorded(rig, seed) for seed in (1, 2, 3))
    answer = diagnose([first], known, [second], [third])
    assert [one.effect for one in answer.report.which] == ['load_dependent_friction']
    values = {name: one['value'] for name, one in answer.report.which[0].parameters.items()}
    assert values['share'] == pytest.approx(0.1, abs=0.03)
    assert values['back_driven'] == pytest.approx(0.3, abs=0.08)
