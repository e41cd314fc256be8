"""The page of a diagnosis: one file, whatever the verdict and whatever the rig measures."""

from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
import re

import numpy as np
import pytest
from synthetic import PERIOD, sampled

from servo_identify.gap import page_charts, page_seconds
from servo_identify.gap.answer import Located
from servo_identify.gap.diagnose import diagnose, Diagnosis
from servo_identify.gap.page import page_of, write_page
from servo_identify.gap.page_laws import laws
from servo_identify.gap.page_seconds import steps, telling_seconds
from servo_identify.gap.resimulation import Run
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find, names
from servo_twin.physics.servo import Placed

SERVO = servo_file.load(
    Path(__file__).resolve().parent.parent / 'config' / 'servos' / 'rv_bench.yaml')
EXCESS, FADE = 9.0, 0.4
WITHOUT = tuple(n for n in names() if n not in ('stribeck_friction', 'gravity'))
"""A small catalogue compiles in seconds, and the page does not mind."""
BALANCES = ('drive', 'motor', 'transmission', 'load', 'torque', 'controller', 'sensor')


def recorded(seed, *without):
    """Return five seconds of a rig whose load side has Stribeck friction."""
    rig = SERVO.with_effects(Placed('s', find('stribeck_friction'), 'load'), values={
        'effects.s.excess': EXCESS, 'effects.s.fade': FADE})
    time = np.arange(int(5.0 / PERIOD)) * PERIOD
    command = sum(1.1 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.5, 1.3, 3.1))
    one = sampled(rig, command, seed=seed)
    for name in without:
        one.columns[name][:] = np.nan
    return replace(one, name=f'multisine_{seed}', family='multisine')


@pytest.fixture(scope='module')
def diagnosis() -> Diagnosis:
    return diagnose([recorded(1)], SERVO, [recorded(2)], [recorded(3)], WITHOUT)


@pytest.fixture(scope='module')
def poor() -> Diagnosis:
    """Diagnose without torque sensor and with one encoder."""
    lost = ('torque', 'load_position')
    return diagnose([recorded(1, *lost)], SERVO, [recorded(2, *lost)], [recorded(3, *lost)],
                    WITHOUT)


class Tags(HTMLParser):
    """Counts what is open, and keeps what would be fetched."""

    def __init__(self):
        super().__init__()
        self.open, self.fetched = [], []

    def handle_starttag(self, tag, attrs):
        self.fetched += [v for k, v in attrs if k in ('src', 'href')]
        if tag not in ('meta', 'br', 'link', 'img'):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def text_of(page):
    body = page[page.index('<body>'):]
    return ' '.join(re.sub(r'<[^>]+>', ' ', body).split())


def judged(diagnosis, status, **changes):
    verdict = {**diagnosis.report.verdict, 'status': status, 'sentence': f'It is {status}.'}
    return replace(diagnosis, report=replace(diagnosis.report, verdict=verdict, **changes))


def test_a_page_is_one_whole_file_that_fetches_nothing(diagnosis, tmp_path):
    page = write_page(diagnosis, tmp_path / 'new' / 'report.html').read_text('utf8')
    tags = Tags()
    tags.feed(page)
    assert tags.open == [] and tags.fetched == []
    assert '<script' not in page and not re.search(r'https?://|@import|url\(', page)


def test_the_command_can_be_what_departs_most(diagnosis):
    one = diagnosis.evidence.stacks['report'].balances[0]
    off = np.full(len(one.seen.recording), 0.5)
    run = Run({'command': off}, {}, np.zeros(len(off), dtype=int))
    shown = page_seconds._shown(one, 'command', slice(0, 100), {'twin': run}, 0.0, False)
    volts = one.seen.recording['voltage'][:100]
    assert shown.unit == 'V' and np.nanmax(np.abs(shown.curves['rig'] - volts)) == 0.0
    assert np.nanmax(np.abs(shown.curves['twin'] - volts + 0.5)) < 1e-12


def test_a_page_says_verdict_place_effect_and_shrink(diagnosis):
    page = page_of(diagnosis)
    text = text_of(page)
    assert diagnosis.report.which
    assert diagnosis.report.verdict['sentence'] in text.replace('&#39;', "'")
    assert 'the gap lies here' in text
    for cause in diagnosis.report.which:
        assert cause.effect.replace('_', ' ') in text
    for recording in ('multisine_1', 'multisine_2', 'multisine_3'):
        assert recording in text
    assert 'nan' not in text.lower().split()


@pytest.mark.parametrize('status', ['no_gap', 'explained', 'partly_explained', 'unknown'])
def test_a_page_is_drawn_for_every_status(diagnosis, status):
    page = page_of(judged(diagnosis, status))
    assert f'<main class="{status}">' in page and f'It is {status}.' in page


def test_a_page_without_causes_leaves_out_what_they_would_fill(diagnosis):
    evidence = replace(diagnosis.evidence, choices=(), best=diagnosis.evidence.base,
                       reported={**diagnosis.evidence.reported, 'steps': []})
    bare = replace(judged(diagnosis, 'unknown', which=(), next_experiment={},
                          waterfall=diagnosis.report.waterfall[:2]), evidence=evidence)
    text = text_of(page_of(bare))
    assert 'No effect of the catalogue stood' in text
    assert 'twin within its tolerances' in text
    assert 'Shrink by excitation' not in text and 'could not be told apart' not in text


def test_a_channel_without_a_gap_has_no_column_and_many_columns_no_neighbour(diagnosis):
    def page_with(**shrinks):
        families = {name: {**one, 'channels': shrinks}
                    for name, one in diagnosis.report.by_family.items()}
        return page_of(judged(diagnosis, 'explained', by_family=families))

    few = page_with(load_position=0.4, current=0.0)
    many = page_with(load_position=0.4, motor_position=0.4, torque=-0.2, wind_up=0.1, current=0.1)
    for page, current, beside in ((few, False, True), (many, True, False)):
        head = re.search(r'<tr><th>recordings</th>(.*?)</tr>', page)[1]
        assert ('current' in head, 'pair uneven' in page) == (current, beside)
        assert 'load position' in head


def test_a_page_says_that_no_recording_would_separate_a_pair(diagnosis):
    following = {'separates': ['gravity', 'spring_load'], 'family': '', 'settings': {}}
    text = text_of(page_of(judged(diagnosis, 'explained', next_experiment=following)))
    assert 'no recording of ten seconds would separate gravity from spring load' in text
    following['measure'] = {'parameter': 'mechanism.stiffness', 'unit': 'N m/rad',
                            'values': {'gravity': 5e5, 'spring_load': 6e5}}
    text = text_of(page_of(judged(diagnosis, 'explained', next_experiment=following)))
    assert 'measure mechanism.stiffness by itself; 5e+05 N m/rad would mean gravity' in text


def test_a_page_of_a_poor_rig_greys_what_it_cannot_observe(poor):
    text = text_of(page_of(poor))
    assert 'motor, load' in text and 'mesh not observable' in text
    assert any('no torque sensor' in w for w in poor.report.warnings) and 'one encoder' in text


def test_a_page_of_a_linear_axis_reads_metres_and_newtons(diagnosis):
    evidence = replace(diagnosis.evidence, servo=replace(diagnosis.evidence.servo, linear=True))
    law = laws(evidence)[0]
    assert law.unit == 'N'
    seconds = telling_seconds(evidence)
    assert 'rad' not in seconds.unit + seconds.error_unit + law.variable_unit


def test_a_law_runs_through_the_residual_that_it_explains(diagnosis):
    law = max(laws(diagnosis.evidence), key=lambda one: np.std(one.dots['before'][1]))
    before, after = (law.dots[n][1] for n in ('before', 'after'))
    assert np.mean(after**2) < 0.3 * np.mean(before**2)
    highest = max(y.max() for _, y in law.curves.values())
    assert 0.3 * before.max() < highest <= 1.1 * before.max()


def test_telling_seconds_show_the_augmented_twin_closer(diagnosis):
    shown = telling_seconds(diagnosis.evidence)
    rms = {name: np.sqrt(np.nanmean(e**2)) for name, e in shown.errors.items()}
    assert rms['augmented'] < 0.5 * rms['twin']
    assert {len(c) for c in (*shown.curves.values(), *shown.errors.values())} == {
        len(shown.time)}


def test_the_intervals_of_a_waterfall_hold_its_bars(diagnosis):
    bars = steps(diagnosis.evidence, diagnosis.report.waterfall)
    assert len(bars) == len(diagnosis.report.waterfall)
    for bar in bars:
        assert bar['interval'][0] <= 1.02 * bar['gap'] and bar['gap'] <= 1.02 * bar['interval'][1]


@pytest.mark.parametrize('balance, block', [
    ('controller', 'command'), ('drive', 'drive'), ('motor', 'motor'), ('transmission', 'mesh'),
    ('load', 'load'), ('sensor', 'sensors')])
def test_a_chain_marks_the_block_in_which_the_gap_lies(balance, block):
    where = tuple(Located(b, 1.0, 5.0, (4.0, 6.0), 'gap' if b == balance else 'not observable')
                  for b in BALANCES)
    chain = page_charts.chain(where, balance, [('an_effect', balance)])
    marked = chain[chain.index('the gap lies here'):]
    assert re.search(r'class="block"[^>]*>([^<]+)<', marked).group(1) == block
    assert chain.count('not observable') == 5 and 'an effect' in chain


def test_a_waterfall_draws_a_step_that_makes_it_worse():
    bars = [{'step': 'as given', 'gap': 0.1, 'interval': (0.08, 0.12)},
            {'step': 'an_effect', 'gap': 0.15, 'interval': (0.1, 0.2)}]
    drawn = page_charts.waterfall(bars, 0.01)
    assert 'class="loss"' in drawn and '+50 %' in drawn and 'an effect' in drawn
    assert 'nan' not in page_charts.waterfall([{'step': 'as given', 'gap': 0.0,
                                                'interval': (0.0, 0.0)}], 0.0)
