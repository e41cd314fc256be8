"""The blind check: its scores on answers whose worth is known, and a small run of it."""

from dataclasses import replace
import json
from math import isnan

import numpy as np
import pytest

from servo_identify.cli import main
from servo_rig_driver.emulated.excitation_families import family
from servo_studies.blind_check import case_runs, resolution
from servo_studies.blind_check.blind_check_page import (
    KINDS_OF_MISS,
    miss_of,
    outcomes_in,
    write_page,
)
from servo_studies.blind_check.case_outcome import judged
from servo_studies.blind_check.case_runs import run_case, Wanted
from servo_studies.blind_check.cases import Case, of_plan, Truth
from servo_studies.blind_check.fault_tables import machines
from servo_studies.blind_check.scoring import confusion, figures, of_baseline, risk_coverage


def a_case(kind, *truths, without=()):
    return Case('rv_plain-made-up', kind, 'rv_plain',
                tuple(Truth(name, multiple, 1.0) for name, multiple in truths), {}, without, {})


def a_report(*which, status='explained', balance='load', where=()):
    return {'which': [{'effect': effect, 'site': site, 'ambiguous_with': list(alike),
                       'shrink_predicted': predicted, 'shrink_realised': realised,
                       'interval': interval}
                      for effect, site, alike, predicted, realised, interval in which],
            'verdict': {'status': status, 'balance': balance, 'sentence': 'made up'},
            'where': list(where)}


def cause(effect, site='', alike=(), predicted=0.5, realised=0.5, interval=(0.4, 0.6)):
    return effect, site, alike, predicted, realised, list(interval)


def figure(outcomes, name, kind=None):
    return next(f for f in figures(outcomes) if f.name == name and kind in (None, f.kind))


def test_it_counts_false_attributions():
    right = judged(a_case('null'), a_report(status='no_gap', balance=''))
    wrong = judged(a_case('null'), a_report(cause('gravity', 'load')))
    found = figure([right, right, right, wrong], 'false attributions')
    assert (found.value, found.of, found.met) == (0.25, 4, False)
    assert found.low < 0.25 < found.high
    assert [o.verdict for o in (right, wrong)] == ['right', 'wrong']


def test_it_counts_first_choices_by_severity():
    known = [judged(a_case('single', ('gravity', m)), a_report(cause(effect, 'load')))
             for m, effect in ((0.5, 'spring_load'), (1.0, 'gravity'), (2.0, 'gravity'),
                               (4.0, 'spring_load'))]
    assert figure(known, 'first choice right, from 1x up').value == pytest.approx(2 / 3)
    assert figure(known, 'first choice right at 0.5x').value == 0.0
    assert figure(known, 'first choice right at 2x').value == 1.0


def test_it_takes_aliases_with_a_reason_and_no_other_side():
    delay = judged(a_case('single', ('command_delay', 1.0)), a_report(cause('current_lag')))
    assert delay.first_right
    side = judged(a_case('single', ('load_drag', 1.0)),
                  a_report(cause('coulomb_friction', 'motor')))
    assert not side.first_right
    assert miss_of(side) == 'wrong side'
    parameter = judged(a_case('single', ('load_drag', 1.0)),
                       a_report(cause('parameter:load_coulomb.level', 'load')))
    assert parameter.exact


def test_it_measures_ambiguity_sets():
    held = judged(a_case('single', ('gravity', 1.0)), a_report(
        cause('load_encoder_eccentricity', '', ('gravity (load)', 'spring_load (load)'))))
    lost = judged(a_case('single', ('gravity', 1.0)), a_report(cause('viscous_friction', 'load')))
    assert (held.in_set, held.first_right, lost.in_set) == (True, False, False)
    name = 'truth in the ambiguity set, of those that name something'
    assert figure([held, lost], name).value == 0.5
    assert figure([held, lost], 'mean size of the ambiguity set').value == 2.0


def test_it_locates_by_the_verdict_or_the_largest_gap():
    gaps = [{'balance': 'motor', 'share': 0.2, 'verdict': 'gap'},
            {'balance': 'load', 'share': 0.8, 'verdict': 'gap'},
            {'balance': 'drive', 'share': 0.9, 'verdict': 'at the noise floor'}]
    told = judged(a_case('single', ('gravity', 1.0)), a_report(balance='motor', where=gaps))
    silent = judged(a_case('single', ('gravity', 1.0)), a_report(balance='', where=gaps))
    assert (told.located, silent.located) == (False, True)


def test_it_asks_unknown_causes_to_be_called_unknown():
    removed = a_case('removed', ('gravity', 2.0), without=('gravity',))
    said = judged(removed, a_report(status='unknown'))
    flagged = judged(removed, a_report(cause('spring_load', 'load'), status='partly_explained'))
    silent = judged(a_case('foreign', ('slosh', 2.0)), a_report(cause('viscous_friction')))
    known = [said, flagged, silent]
    assert figure(known, 'says unknown').value == pytest.approx(2 / 3)
    assert figure(known, 'names a wrong cause').value == pytest.approx(2 / 3)
    assert figure(known, 'of those named, flagged').value == 0.5


def test_it_wants_the_exact_set_of_two_and_three():
    pair = a_case('pair', ('gravity', 2.0), ('hysteresis', 2.0))
    exact = judged(pair, a_report(cause('hysteresis', 'mesh'), cause('gravity', 'load')))
    half = judged(pair, a_report(cause('gravity', 'load')))
    more = judged(pair, a_report(cause('gravity', 'load'), cause('hysteresis', 'mesh'),
                                 cause('spring_load', 'load')))
    assert figure([exact, half, more], 'exact set', 'two effects').value == pytest.approx(1 / 3)
    assert [miss_of(o) for o in (exact, half, more)] == ['', 'incomplete', 'wrong cause']
    assert isnan(figure([exact], 'exact set', 'three effects').value)


def test_it_holds_realised_against_predicted_shrink():
    single = a_case('single', ('gravity', 1.0))
    known = [judged(single, a_report(cause('gravity', 'load', (), p, 0.8 * p, (0.8 * p, edge))))
             for p, edge in ((0.2, 0.3), (0.5, 0.6), (0.9, 0.8))]
    slope = figure(known, 'slope of realised over predicted shrink')
    assert (slope.value, slope.met) == (pytest.approx(0.8), False)
    covered = figure(known, '90 % intervals of the realised shrink that hold the predicted')
    assert covered.value == pytest.approx(2 / 3)


def test_it_shows_what_was_taken_for_what():
    right = judged(a_case('single', ('gravity', 1.0)), a_report(cause('gravity', 'load')))
    wrong = judged(a_case('null'), a_report(cause('gravity', 'load')))
    faint = judged(a_case('single', ('gravity', 0.5)), a_report(status='no_gap'))
    rows, columns, table = confusion([right, right, wrong, faint])
    assert (rows, columns) == (['(nothing)', 'gravity'], ['gravity'])
    assert table.tolist() == [[1], [2]]


def test_it_orders_risk_by_confidence():
    sure = judged(a_case('single', ('gravity', 1.0)),
                  a_report(cause('gravity', 'load', predicted=0.9)))
    unsure = judged(a_case('null'), a_report(cause('gravity', 'load', predicted=0.1)))
    silent = judged(a_case('null'), a_report(status='no_gap'))
    coverage, risk = risk_coverage([unsure, sure, silent])
    assert coverage == pytest.approx([1 / 3, 2 / 3])
    assert risk == pytest.approx([0.0, 0.5])


def test_it_counts_a_failure_as_a_miss():
    failed = replace(judged(a_case('single', ('gravity', 1.0)), a_report()), status='failed')
    assert (failed.verdict, miss_of(failed)) == ('failed', 'no answer')
    assert figure([failed], 'first choice right, from 1x up').value == 0.0


def test_it_scores_baselines_like_the_diagnosis():
    answer = {'named': [{'effect': 'coulomb_friction', 'site': 'load'}], 'shrink': 0.3}
    assert figure([of_baseline(a_case('null'), answer)], 'false attributions').value == 1.0
    assert miss_of(of_baseline(a_case('null'), answer)) in KINDS_OF_MISS


@pytest.mark.parametrize('name, settings', [
    ('speed_ladder', {'speeds': [0.1, 0.4, 1.0]}), ('slow_reversals', {'speed': 0.1, 'period': 2}),
    ('turns', {'speed': 1.0}), ('load_steps', {'speed': 0.3, 'torque': 60.0}),
    ('chirp', {'amplitude': 1.4, 'from': 0.5, 'to': 15.0}),
    ('multisine', {'amplitude': 1.4, 'from': 0.5, 'to': 10.0, 'lines': 8}),
    ('sine', {'amplitude': 1.6, 'frequency': 0.5})])
def test_it_has_the_rig_make_what_is_proposed(name, settings):
    order = resolution.as_order(machines()['rv_plain'], name, {**settings, 'duration': 10.0})
    reference, external = family(name).waves(np.arange(100) * 0.1, order['settings'])
    assert order['duration'] == 10.0
    assert max(np.abs(reference).max(), np.abs(external).max()) > 0.05


def test_it_scores_ambiguous_pairs_by_the_recording_proposed(tmp_path, monkeypatch):
    single = a_case('single', ('gravity', 1.0))
    told = {'separates': ['gravity', 'spring_load'], 'family': 'turns', 'settings': {'speed': 1.0}}
    (tmp_path / 'diagnosis').mkdir()
    first = a_report(cause('gravity', 'load', ('spring_load',))) | {'next_experiment': told}
    (tmp_path / 'diagnosis' / 'report.json').write_text(json.dumps(first))
    made = []
    monkeypatch.setattr(resolution, 'make_bags', lambda orders, servo, place: [
        made.append(order['family']) or place / order['name'] for order in orders])

    def ask(bags, folder):
        alike = () if folder.name == 'proposed' else ('spring_load (load)',)
        assert len(bags['screen']) == 2
        return a_report(cause('gravity', 'load', alike))

    resolution.resolve(single, {'screen': [], 'accept': [], 'report': []}, tmp_path, ask)
    answer = json.loads((tmp_path / 'resolved.json').read_text())
    assert (made[:2], answer['by_proposed'], answer['by_random']) == (['turns'] * 2, True, False)
    outcome = replace(judged(single, first), resolved=answer)
    assert figure([outcome], 'resolved by the proposed recording').met
    assert figure([outcome], 'resolved by a random one').value == 0.0


def test_an_ambiguous_pair_without_a_proposal_counts_as_not_resolved(tmp_path, monkeypatch):
    single = a_case('single', ('gravity', 1.0))
    told = {'separates': ['gravity', 'spring_load'], 'family': '', 'settings': {}}
    (tmp_path / 'diagnosis').mkdir()
    first = a_report(cause('gravity', 'load', ('spring_load',))) | {'next_experiment': told}
    (tmp_path / 'diagnosis' / 'report.json').write_text(json.dumps(first))
    monkeypatch.setattr(resolution, 'make_bags', lambda orders, servo, place: [
        place / order['name'] for order in orders])
    resolution.resolve(single, {'screen': [], 'accept': [], 'report': []}, tmp_path,
                       lambda bags, folder: a_report(cause('gravity', 'load')))
    answer = json.loads((tmp_path / 'resolved.json').read_text())
    assert (answer['by_proposed'], answer['by_random'], answer['by_value']) == (False, True, False)
    outcome = replace(judged(single, first), resolved=answer)
    assert figure([outcome], 'resolved by the proposed recording').value == 0.0
    assert figure([outcome], 'by the recording, or the value to be measured').value == 0.0
    assert figure([outcome], 'the same where a recording is proposed at all').of == 0


@pytest.mark.parametrize('withheld, told', [(0.07, True), (0.02, False)])
def test_a_value_to_be_measured_is_held_against_that_of_the_rig(tmp_path, monkeypatch, withheld,
                                                                told):
    """The gain of the drive is off: its own value says so, that of a good one would not."""
    single = replace(a_case('single'), truths=(Truth('drive_gain', 1.0, withheld),),
                     set={'drive.gain': 0.49, 'withheld.drive_gain': withheld})
    proposed = {'separates': ['parameter:gain', 'current_sensor_gain'], 'family': '',
                'settings': {}, 'measure': {'parameter': 'drive.gain', 'unit': 'A/V', 'values': {
                    'parameter:gain': 0.525, 'current_sensor_gain': 0.495}}}
    (tmp_path / 'diagnosis').mkdir()
    first = a_report(cause('parameter:gain', 'drive', ('current_sensor_gain',)))
    first |= {'next_experiment': proposed}
    (tmp_path / 'diagnosis' / 'report.json').write_text(json.dumps(first))
    monkeypatch.setattr(resolution, 'make_bags', lambda orders, servo, place: [])
    resolution.resolve(single, {'screen': [], 'accept': [], 'report': []}, tmp_path,
                       lambda bags, folder: None)
    answer = json.loads((tmp_path / 'resolved.json').read_text())
    assert (answer['by_proposed'], answer['by_value']) == (False, told)
    outcome = replace(judged(single, first), resolved=answer)
    assert figure([outcome], 'by the recording, or the value to be measured').value == told


def test_a_value_that_the_rig_was_given_holds_what_is_withheld_already():
    stiff = replace(a_case('single'), truths=(Truth('stiffness_error', 1.0, 0.2),),
                    set={'machine.stiffness': 6e5})
    measured = {'parameter': 'mechanism.stiffness', 'unit': 'N m/rad',
                'values': {'stiffness_error': 6e5, 'backlash': 7e5}}
    assert resolution._told_by_value(stiff, measured)


@pytest.mark.parametrize('separates, asked', [
    ([], []), (['gravity', 'spring_load'], ['gravity', 'spring_load']),
    (['cogging', 'torque_ripple'], [])])
def test_it_asks_again_only_where_a_truth_was_left_open(tmp_path, separates, asked):
    single = a_case('single', ('gravity', 1.0))
    assert resolution.open_pair(single, tmp_path) == []
    (tmp_path / 'diagnosis').mkdir()
    answer = a_report(cause('gravity', 'load')) | {'next_experiment': {'separates': separates}}
    (tmp_path / 'diagnosis' / 'report.json').write_text(json.dumps(answer))
    assert resolution.open_pair(single, tmp_path) == asked
    (tmp_path / 'resolved.json').write_text('{}')
    assert resolution.open_pair(single, tmp_path) == []


def test_a_case_that_is_answered_has_no_recordings_made_again(tmp_path, monkeypatch):
    single = a_case('single', ('gravity', 1.0))
    place = tmp_path / single.name / 'diagnosis'
    place.mkdir(parents=True)
    (place / 'report.json').write_text(json.dumps(a_report(cause('gravity', 'load'))))
    monkeypatch.setattr(case_runs, 'make_bags',
                        lambda *orders: pytest.fail('recordings were made'))
    run_case(single, tmp_path, Wanted(baselines=False, resolution=True))


def run(folder, *options):
    return main(['blind-check', '--reduced', '-o', str(folder), '--page', str(folder / 'page.md'),
                 *options])


@pytest.mark.long
@pytest.mark.slow
def test_it_runs_a_small_check_and_goes_on_where_it_stood(tmp_path, capsys):
    options = ('--case', 'null-01', '--case', 'single-gravity-4x')
    assert run(tmp_path, *options) == 0
    chosen = [c for c in of_plan('reduced') if 'null' in c.name or 'gravity-4x' in c.name]
    known = {o.case.kind: o for o in outcomes_in(chosen, tmp_path / 'reduced')}
    assert not known['null'].named, known['null'].sentence
    assert known['single'].first_right, known['single'].sentence
    assert known['single'].located

    reports = list(tmp_path.glob('reduced/*/diagnosis/report.json'))
    before = {path: path.stat().st_mtime_ns for path in reports}
    page = (tmp_path / 'page.md').read_text()
    assert run(tmp_path, *options, '--force') == 0
    assert {path: path.stat().st_mtime_ns for path in reports} == before
    assert '| nothing withheld | false attributions | 0 % |' in page
    assert 'gravity' in capsys.readouterr().out
    assert not list(tmp_path.glob('reduced/*/bags'))


def test_it_keeps_what_was_written_about_misses(tmp_path):
    missed = judged(a_case('null'), a_report(cause('gravity', 'load')))
    page = tmp_path / 'page.md'
    write_page(page, [missed], tmp_path, 'reduced', 'made up', 1)
    text = page.read_text().replace('<!-- learned: false alarm -->\n',
                                    '<!-- learned: false alarm -->\nOf little use.')
    page.write_text(text)
    write_page(page, [missed], tmp_path, 'reduced', 'made up', 1)
    assert 'Of little use.' in page.read_text()
