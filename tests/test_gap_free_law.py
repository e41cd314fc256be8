"""A law that nobody knows, and its nearest relative in the catalogue."""

from types import SimpleNamespace

import numpy as np
import pytest
from screened import BENCH, chosen_of, names_of, screened, swinging, twice, with_effects

from servo_identify.gap import status
from servo_identify.gap.diagnose import diagnose
from servo_identify.gap.free_law import outdone_by
from servo_identify.gap.periodic_law import periodically_outdone_by
from servo_identify.gap.plain_law import plainly_outdone_by
from servo_twin.physics.catalogue import names

WEIGHT = ('gravity', 'load', {'sine': 20.0, 'cosine': 8.0})
ONE_WAY = ('asymmetric_friction', 'load', {'difference': 15.0, 'slope': 0.0})


def outdone(screening):
    """Return by name of each chosen cause the variable of the free law that outdoes it."""
    chosen = chosen_of(screening)
    return {name: outdone_by(screening, chosen, one)
            for name, one in zip(names_of(screening, chosen), chosen, strict=True)}


def test_a_weight_that_no_catalogue_knows_is_not_taken_for_its_relative():
    screening = twice(with_effects(WEIGHT), 'asymmetric_friction')
    assert outdone(screening)['asymmetric_friction'] == 'angle of the load'


@pytest.mark.parametrize('effects', ((WEIGHT,), (ONE_WAY,), (WEIGHT, ONE_WAY)))
def test_what_is_there_is_outdone_by_no_free_law(effects):
    screening = twice(with_effects(*effects), 'asymmetric_friction', 'gravity')
    assert outdone(screening) == {name: '' for name, _, _ in effects}


def test_bristles_are_not_taken_for_a_law_that_has_no_memory():
    drag = ('quadratic_drag', 'load', {'rise': 200.0})
    assert 'presliding_friction' not in outdone(twice(with_effects(drag), 'presliding_friction'))
    slope = ('viscous_friction', 'motor', {'slope': 2e-3})
    bristles = ('presliding_friction', 'load', {'level': 40.0, 'breakaway': 5e-3})
    for effect, variable in ((slope, 'speed'), (bristles, '')):
        told = outdone(twice(with_effects(effect), 'presliding_friction'))
        assert told['presliding_friction'] == variable


OVER_THE_TURN = {'order': 8.0, 'cosine': (0.1, 0.0, 0.0), 'sine': (0.05, 0.0, 0.0)}
ROUGH = ('position_dependent_friction', 'motor', OVER_THE_TURN)
RIPPLE = ('torque_ripple', 'motor', {**OVER_THE_TURN, 'cosine': (0.02, 0.0), 'sine': (0.03, 0.0)})
COGS = ('cogging', 'motor', {**OVER_THE_TURN, 'cosine': (0.1, 0.0), 'sine': (0.05, 0.0)})


@pytest.mark.parametrize(('effect', 'known', 'law'), (
    (ROUGH, 'position_dependent_friction', ()), (RIPPLE, 'torque_ripple', ()),
    (COGS, 'cogging', ()),
    (RIPPLE, 'position_dependent_friction', ('angle of the motor', 'current'))))
def test_a_periodic_law_is_told_from_another_by_what_it_is_multiplied_by(effect, known, law):
    screening = twice(with_effects(effect), known)
    one = chosen_of(screening)[0]
    assert screening.library.candidates[one].key == (known, 'motor')
    assert periodically_outdone_by(screening, [one], one) == law


LEVEL = ('coulomb_friction', 'motor', {'level': 0.15})
SLOPE = ('viscous_friction', 'motor', {'slope': 4e-3})
BRISTLES = ('presliding_friction', 'motor', {'level': 0.15, 'breakaway': 0.5})
DRAG = ('quadratic_drag', 'motor', {'rise': 2e-5})
TAIL = ('stribeck_friction', 'motor', {'excess': 0.15, 'fade': 20.0})


@pytest.mark.parametrize(('effect', 'known', 'variable'), (
    (LEVEL, 'presliding_friction', 'direction'), (BRISTLES, 'presliding_friction', ''),
    (SLOPE, 'quadratic_drag', 'speed'), (DRAG, 'quadratic_drag', ''),
    (LEVEL, 'stribeck_friction', 'direction'), (TAIL, 'stribeck_friction', '')))
def test_a_law_is_not_taken_where_a_plain_one_that_it_has_as_its_limit_does_as_much(
        effect, known, variable):
    screening = twice(with_effects(effect), known)
    one = next(c for c in chosen_of(screening)
               if screening.library.candidates[c].key == (known, 'motor'))
    assert plainly_outdone_by(screening, [one], one) == variable


def test_a_free_law_is_given_no_credit_for_a_constant_that_any_law_of_it_holds():
    rig = with_effects(('current_sensor_offset', 'current', {'offset': 0.1}))
    rig = rig.with_values({'drive.torque_constant': 1.2 * BENCH.values['drive.torque_constant']})
    assert outdone(twice(rig, 'gravity'))['torque_constant_error'] == ''


def test_a_diagnosis_takes_nothing_that_a_free_law_outdoes_and_says_what_the_law_is_of():
    rig = with_effects(WEIGHT)
    recordings = [[swinging(rig, seed)] for seed in (1, 2, 3)]
    known = ('asymmetric_friction', 'load_dependent_friction')
    found = diagnose(recordings[0], BENCH, recordings[1], recordings[2],
                     tuple(n for n in names() if n not in known)).report
    assert (found.verdict['status'], found.which) == ('unknown', ())
    assert found.unknown['depends_on'][0] == 'angle of the load'
    assert found.unknown['parity'] == 'even'
    assert any('a law of the angle of the load alone would do no less' in said
               for said in found.warnings)


def test_the_rows_of_a_gap_are_those_of_the_family_that_shows_it_where_no_balance_does():
    stack = screened([swinging(BENCH, 1), swinging(BENCH, 2, 'creep', 0.6)], BENCH,
                     'gravity').stack
    motor, creep = stack.balance == 1, stack.recording == 1
    quiet = np.full(len(stack.base), 0.5)
    np.testing.assert_array_equal(stack.showing(quiet)['motor'], motor)
    faint = np.where(motor & creep, 1.5, 0.5)
    assert np.mean(faint[motor]**2) < 1.3
    np.testing.assert_array_equal(stack.showing(faint)['motor'], motor & creep)
    np.testing.assert_array_equal(stack.showing(np.where(motor, 1.3, faint))['motor'], motor)


@pytest.mark.parametrize('left, refuted', ((0.9, True), (0.5, False)))
def test_a_cause_found_in_one_family_is_refuted_by_that_family(monkeypatch, left, refuted):
    stack = screened([swinging(BENCH, 1), swinging(BENCH, 2, 'creep', 0.6)], BENCH,
                     'gravity').stack
    faint = np.where((stack.balance == 1) & (stack.recording == 1), 1.5, 0.5)
    after = np.where(stack.recording == 1, left * faint, faint)
    monkeypatch.setattr(status, 'shrunk', lambda evidence: -0.5)
    monkeypatch.setattr(status, 'leftover', lambda others, explanation: faint)
    evidence = SimpleNamespace(stacks={'report': stack}, reported={'left': after},
                               base=SimpleNamespace(explanation=None),
                               choices=[SimpleNamespace(balances=('motor',))])
    assert status._refuted(evidence, set()) is refuted


FAINT = ('cogging', 'motor', {'sine': (2.5e-3, 0.0, 0.0), 'cosine': (0.0, 0.0, 0.0)})


def test_a_ripple_that_shows_at_a_creep_alone_is_found():
    rig = with_effects(FAINT)
    creep = [swinging(rig, seed, 'creep', 0.5) for seed in (3, 4)]
    screening = screened([swinging(rig, 1), swinging(rig, 2), *creep], BENCH, 'cogging', 'gravity')
    assert max(screening.squares([]).values()) < 1.3
    assert names_of(screening, chosen_of(screening)) == ['cogging']


def test_a_gap_that_one_family_alone_shows_is_said_to_be_where_its_cause_is():
    rig = with_effects(FAINT)
    made = [swinging(rig, seed, *settings) for settings in ((), ('creep', 0.5))
            for seed in (1, 2, 3, 4)]
    report = diagnose(made, BENCH, without=tuple(n for n in names() if n != 'cogging')).report
    assert report.verdict['effects'] == ['cogging']
    told = {one.balance: one for one in report.where}
    assert report.verdict['balance'] == 'motor' and told['motor'].verdict == 'gap'
    assert told['motor'].share > 0.9
