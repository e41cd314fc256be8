"""What stays ambiguous after a diagnosis, and the recording that it proposes for it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from screened import BENCH, chosen_of, names_of, screened, stacked
from synthetic import PERIOD, sampled

from servo_identify.gap import experiment_choice, menu
from servo_identify.gap.ambiguity import explain, stands_in
from servo_identify.gap.balance import BALANCES
from servo_identify.gap.experiment_choice import next_experiment, separation
from servo_identify.gap.menu import recordings_of_the_menu
from servo_identify.gap.sentence import next_step
from servo_rig_driver.emulated.excitation import family
from servo_studies.blind_check.definitions import machines
from servo_studies.blind_check.resolution import as_order
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

SERVO = replace(BENCH, tolerance={**BENCH.tolerance, 'effects.coulomb.level': (20.0, 24.0)})
CATALOGUE = ('presliding_friction', 'friction_drift', 'gravity', 'spring_load')


def quick(rig, seed, seconds=6.0):
    """Return a recording that stays within a part of a turn."""
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    command = sum(1.6 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (1.3, 2.1, 3.1))
    return replace(sampled(rig, command, seed=seed), name=f'quick {seed}', family='multisine')


def wide(rig, seed):
    """Return a recording that goes far out and back."""
    time = np.arange(int(10.0 / PERIOD)) * PERIOD
    command = 2.0 * np.sin(2.0 * np.pi * 0.1 * time)
    return replace(sampled(rig, command, seed=seed), name='wide', family='sine')


def twice(rig, *known):
    """Return a screening of two recordings of a rig with a small catalogue."""
    return screened([quick(rig, 1), quick(rig, 2)], SERVO, *known)


@pytest.fixture(scope='module')
def weighted():
    """Return a rig with a weight at its load, and its screening."""
    rig = SERVO.with_effects(Placed('w', find('gravity'), 'load'), values={
        'effects.w.sine': 3.0, 'effects.w.cosine': 1.0})
    return rig, twice(rig, *CATALOGUE)


def test_a_coulomb_level_is_not_ambiguous_with_laws_of_which_it_is_the_limit():
    screening = twice(SERVO.with_values({'effects.coulomb.level': 40.0}), *CATALOGUE)
    chosen = chosen_of(screening)
    known = screening.library.candidates
    assert names_of(screening, chosen) == ['parameter:coulomb.level']
    start, gain = screening.loss([]), screening.loss([]) - screening.loss(chosen)
    as_good = {known[c].name for c in range(len(known))
               if start - screening.loss([c]) > 0.99 * gain}
    assert 'presliding_friction' in as_good  # it explains as much, with numbers of its own
    assert explain(screening, chosen)[0].ambiguous == ()


def test_a_balance_is_heard_beside_one_that_misses_a_thousand_times_more():
    rig = SERVO.with_effects(
        Placed('b', find('backlash'), 'mesh'), Placed('t', find('transmission_error'), 'mesh'),
        Placed('v', find('viscous_friction'), 'motor'),
        values={'effects.b.width': 1e-3, 'effects.t.cosine': (2e-4,), 'effects.v.slope': 2e-4})
    # what the mesh lacks is not all known here, so that much of a huge gap is left there
    screening = twice(rig, 'backlash', 'position_dependent_backlash', 'viscous_friction')
    first = screening.squares([])
    motor, mesh = BALANCES.index('motor'), BALANCES.index('transmission')
    assert first[mesh] > 300.0 * first[motor] > 3000.0
    chosen = chosen_of(screening)
    assert ('viscous_friction', 'motor') in {screening.library.candidates[c].key for c in chosen}
    assert screening.squares(chosen)[motor] < 0.05 * first[motor]


def test_a_simpler_law_is_no_stand_in_where_a_recording_shows_what_it_leaves(weighted):
    _, screening = weighted
    best = chosen_of(screening)
    assert names_of(screening, best)[0] == 'gravity'
    level = next(c for c, known in enumerate(screening.library.candidates)
                 if known.name == 'parameter:coulomb.level')
    assert not stands_in(screening, best[0], level, [])
    assert stands_in(screening, best[0], best[0], [])


def test_a_recording_that_goes_round_separates_a_weight_from_a_spring(weighted):
    rig, screening = weighted
    weight = chosen_of(screening)[:1]
    spring = next(c for c in screening.library.candidates if c.name == 'spring_load')
    extended = screening.stack.extended
    told = {recording.name: separation(screening, stacked([recording], extended), weight,
                                       weight[0], spring)
            for recording in (quick(rig, 1), wide(rig, 3))}
    assert told['wide'] > 2.0 * told['quick 1']
    assert told['wide'] > 1.0


def test_no_recording_of_the_menu_goes_far_beyond_those_that_are_there(weighted):
    rig, screening = weighted
    evidence = SimpleNamespace(stacks={'screen': screening.stack}, augmented=rig, servo=SERVO)
    made = [more.balances[0].seen.recording for _, _, more in recordings_of_the_menu(evidence)]
    assert {'turns', 'speed_ladder', 'slow_reversals'} <= {one.family for one in made}
    known = [one.seen.recording for one in screening.stack.balances]
    assert all(np.ptp(one['load_position']) <= menu.BEYOND * max(
        np.ptp(before['load_position']) for before in known) for one in made)


def proposed(monkeypatch, told):
    """Return what is proposed where the recordings of a menu separate as far as is told."""
    made = [('sine', {'amplitude': 1.0, 'frequency': 0.5}, 0),
            ('chirp', {'amplitude': 1.0, 'from': 0.5, 'to': 15.0}, 1)]
    monkeypatch.setattr(experiment_choice, 'recordings_of_the_menu',
                        lambda evidence: iter(made))
    monkeypatch.setattr(experiment_choice, 'separation',
                        lambda screening, more, kept, one, other, closely=True: told[more])
    gravity, spring = (SimpleNamespace(name=n, paths=()) for n in ('gravity', 'spring_load'))
    evidence = SimpleNamespace(choices=(SimpleNamespace(ambiguous=(spring,)),), servo=SERVO)
    screening = SimpleNamespace(library=SimpleNamespace(candidates=[gravity]))
    return next_experiment(evidence, screening, [0])


def test_the_recording_is_proposed_that_separates_most(monkeypatch):
    answer = proposed(monkeypatch, (2.0, 5.0))
    assert (answer['separates'], answer['family']) == (['gravity', 'spring_load'], 'chirp')
    assert answer['settings']['duration'] == menu.DURATION and answer['expected_ratio'] == 5.0


def test_none_is_proposed_where_none_would_separate(monkeypatch):
    assert proposed(monkeypatch, (0.4, 0.9)) == {
        'separates': ['gravity', 'spring_load'], 'family': '', 'settings': {}}


def test_where_no_recording_separates_a_value_from_a_reading_the_value_is_to_be_measured(
        monkeypatch):
    gain, constant = (BENCH.values[f'drive.{name}'] for name in ('gain', 'torque_constant'))
    servo = replace(BENCH, tolerance={
        **BENCH.tolerance, 'drive.torque_constant': (0.7 * constant, 1.3 * constant)})
    rig = servo.with_values({'drive.gain': 1.2 * gain})
    screening = screened([quick(rig, 1), quick(rig, 2)], servo, 'current_sensor_gain')
    chosen = chosen_of(screening)
    assert names_of(screening, chosen) == ['parameter:gain']
    monkeypatch.setattr(experiment_choice, 'recordings_of_the_menu', lambda evidence: iter(()))
    answer = next_experiment(
        SimpleNamespace(choices=explain(screening, chosen), servo=servo), screening, chosen)
    assert answer['separates'] == ['parameter:gain', 'current_sensor_gain']
    told = answer['measure']
    assert (told['parameter'], told['unit']) == ('drive.gain', 'A/V')
    least, most = servo.tolerance['drive.gain']
    assert told['values']['parameter:gain'] == pytest.approx(1.2 * gain, rel=0.01)
    assert least <= told['values']['current_sensor_gain'] <= most
    said = next_step(answer, linear=False)
    assert 'measure drive.gain by itself' in said and 'A/V would mean parameter:gain' in said


@pytest.mark.parametrize('name, settings', [
    ('speed_ladder', {'speeds': [0.1, 0.2, 0.4, 0.8], 'acceleration': 4.0}),
    ('slow_reversals', {'speed': 0.1, 'period': 2.5}),
    ('turns', {'speed': 0.5, 'acceleration': 4.0}),
    ('load_steps', {'speed': 0.3, 'torque': 60.0, 'acceleration': 4.0}),
    ('chirp', {'amplitude': 1.4, 'from': 0.5, 'to': 15.0}),
    ('sine', {'amplitude': 1.6, 'frequency': 0.5})])
def test_what_is_simulated_is_what_the_rig_makes_of_the_proposal(name, settings):
    time = np.arange(int(menu.DURATION / PERIOD)) * PERIOD
    order = as_order(machines()['rv_plain'], name, {**settings, 'duration': menu.DURATION})
    theirs = family(name).waves(time, order['settings'])
    for ours, made in zip(menu._waves(name, settings, time), theirs, strict=True):
        off = np.mean((ours - made)**2) / max(np.mean(made**2), 1e-12)
        assert off < 0.02
