"""The page of a diagnosis: its words, its numbers and what it may hold."""

from html import unescape
from html.parser import HTMLParser
import re

from diagnosis_document import BARE, document, hostile_document, STATUSES
import numpy as np
import pytest

from servo_identify.diagnose.page.packed_series import packed_series
from servo_identify.diagnose.page.page import page_of, STATUS
from servo_identify.diagnose.page.page_tables import gap_bars
from servo_identify.diagnose.page.words import number, percent, ratio, shortened, unit

PARTS = ('channels', 'where', 'which', 'gap', 'unknown', 'next_experiment', 'moved', 'defaults',
         'equations', 'stability', 'findings', 'confirm', 'warnings', 'timing', 'recordings')


class Elements(HTMLParser):
    """Collects elements, and what they would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.names, self.fetched, self.handlers = [], [], []

    def handle_starttag(self, tag, attrs):
        self.names.append(tag)
        for name, value in attrs:
            if name in ('src', 'href') and not value.startswith(('#', 'data:')):
                self.fetched.append(value)
            if name.startswith('on'):
                self.handlers.append(name)


def elements_of(page: str) -> Elements:
    elements = Elements()
    elements.feed(page)
    return elements


def text_of(page: str) -> str:
    body = page[page.index('<body>'):page.index('<!-- uPlot')]
    return ' '.join(re.sub(r'<[^>]+>', ' ', body).split())


@pytest.mark.parametrize('status', STATUSES)
def test_the_badge_follows_the_status_alone(status):
    one = document(status)
    page = page_of(one)
    assert f'id="badge">{STATUS[status]}<' in page
    assert f'<main class="{status}">' in page
    assert text_of(page).count(one['report']['verdict']['sentence']) == 1
    assert ('What is missing' in text_of(page)) == bool(one['report']['which'])


def test_it_refuses_a_status_that_it_does_not_know():
    with pytest.raises(ValueError, match="status = 'fine' is not one of .*partly_explained"):
        page_of({'report': {'verdict': {'status': 'fine'}}})


def test_it_says_what_the_document_says():
    said = text_of(page_of(document()))
    for expected in (
            'the gap lies here', 'stribeck friction', '6.214 N m', '5.802 to 6.626',
            'without it 68 % of the gap comes back (61 to 74 %), predicted 71 %', '81 µrad',
            'A load step at standstill changes it', 'at its bound', '+10.0 %', 'Defaults taken',
            'To tell apart stribeck friction and load dependent friction', 'It repeats 161 times',
            '--reach travel=2', 'Friction grows by 1.4 N m', 'Turn the load by hand',
            'Record a sweep up to 8 Hz.', 'upper bound, 6.336 kg m2', '21.7 s', 'fit as given',
            '91 %', '1' * 64, 'backlash named in 85 % of 20 splits', 'multisine_3, load_steps_3'):
        assert expected in said, expected


def test_it_leaves_out_what_is_empty_or_missing():
    whole = document()
    for part in PARTS:
        for one in ({**whole['report'], part: type(whole['report'][part])()},
                    {k: v for k, v in whole['report'].items() if k != part}):
            assert 'None' not in text_of(page_of({'report': one}))
    del whole['report']['which'][0]['alternatives']
    del whole['report']['which'][0]['ambiguous_with']
    assert text_of(page_of(whole)).count('Nothing else in the catalogue') == 1
    bare = elements_of(page_of(BARE))
    assert 'section' not in bare.names and 'table' not in bare.names


def test_hostile_names_stay_names():
    hostile = hostile_document()
    elements = elements_of(page_of(hostile))
    ours = elements_of(page_of(document()))
    assert elements.names.count('script') == ours.names.count('script') == 7
    assert 'img' not in elements.names and not elements.handlers


def test_the_page_is_one_file_with_its_library_and_licence():
    page = page_of(document())
    assert not elements_of(page).fetched
    assert 'Permission is hereby granted, free of charge' in page
    assert "default-src 'none'" in unescape(page)
    assert len(page) < 2.5e6


def test_samples_are_carried_to_a_tenth_of_the_noise():
    rig = [1.61e2 + 3e-6, None, float('inf'), 1.61e2 - 4e-6, -7.0]
    carried = packed_series({'t': [0.0, 0.1, 0.2, 0.3, 0.4], 'channels': {
        'motor_position': {'noise': 2e-6, 'rig': rig, 'as_given': None}}})
    one = carried['channels']['motor_position']
    assert [step is None for step in one['rig']['steps']] == [False, True, True, False, False]
    sums = np.cumsum([step or 0 for step in one['rig']['steps']]) * one['rig']['quantum']
    assert np.abs(sums[[0, 3, 4]] - np.array(rig)[[0, 3, 4]].astype(float)).max() < 2e-7
    assert one['as_given']['steps'] == []
    without_noise = {'rig': [100.0, 100.001], 'as_given': [100.0, 100.0]}
    carried = packed_series({'channels': {'load_position': without_noise}})
    assert carried['channels']['load_position']['rig']['quantum'] < 1e-6


@pytest.mark.parametrize(('value', 'said'), [
    (0.0, '0'), (5.0e5, '5 × 10⁵'), (0.48782, '0.4878'), (-1.14e-4, '−1.14 × 10⁻⁴'),
    (9999.6, '10000'), (None, '–'), (float('nan'), '–'), (True, '–')])
def test_numbers_have_four_digits(value, said):
    assert number(value) == said


def test_a_residual_far_below_the_noise_is_only_said_to_be_small():
    said = text_of(page_of(document()))
    assert '&lt; 0.01 × noise' in said and '10⁻⁵ × noise' not in said
    assert [ratio(value) for value in (0.0, 0.0099, 0.0123, 31.24)] == [
        '0', '< 0.01', '0.0123', '31.2']


def test_it_says_what_shrinks_once_and_by_which_interval():
    said = text_of(page_of(document()))
    assert 'on unseen recordings 77 % (90 % interval: 68 to 81 %)' in said
    assert said.count('gone of what is above the noise') == 1


def test_a_file_that_stays_as_given_has_no_augmented_twin():
    one = document()
    gap = one['report']['gap'] | {'refitted': 0.1}
    assert {'augmented twin', 'augmented, refitted'} <= {
        bar['step'] for bar in gap_bars(gap, True)}
    one['report']['gap'] = gap
    gap.update(after=gap['before'], shrink=0.0, interval=[0.0, 0.0])
    said = text_of(page_of(one))
    assert 'augmented twin' not in said and 'augmented, refitted' not in said
    assert 'gone of what is above the noise' not in said


def test_it_says_a_symmetry_by_what_it_is_one_of():
    one = document()
    said = text_of(page_of(one))
    assert 'Mechanism: friction; depends on load speed; odd in the direction of motion;' in said
    one['report']['which'][0]['mechanism']['symmetry'] = 'none'
    assert 'none in the direction' not in text_of(page_of(one))


def test_the_values_of_a_refit_are_not_taken_for_those_of_the_patch():
    said = text_of(page_of(document()))
    assert 'What --refit writes into the servo file' in said
    assert 'two of which reach the bound' in said


def test_shares_and_units_read_well():
    assert [percent(s) for s in (0.853, 0.0832, 0.997, 1.0, None)] == [
        '85 %', '8.3 %', '> 99 %', '100 %', '–']
    assert unit('kg m2') == 'kg m²'
    assert shortened('rad', 8e-5) == (1e-6, 'µrad') and shortened('kg m2', 1e-4)[0] == 1.0
