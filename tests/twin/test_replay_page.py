"""The page of a recording, and the charts on it."""

from html.parser import HTMLParser
import re

from bench_recording import bench_recording, SERVO
from headless_chromium import Browser, found
from hypothesis import given, strategies
import numpy as np
import pytest

from servo_twin.description.servo_file import load
from servo_twin.lockstep.whole_recording import Answering
from servo_twin.pages.event_table import rows_of
from servo_twin.pages.replay_page import colour, page_of, Replayed, write_page
from servo_twin.pages.svg_charts import line_chart, ticks
from servo_twin.recording.events import Happened


def replayed(servo, recording):
    kept = Replayed(servo, recording)
    for part, answer in Answering(recording, servo):
        kept.add(part, answer)
    return kept


@pytest.fixture(scope='module')
def page():
    servo, recording = load(SERVO), bench_recording(coulomb=30.0)
    return page_of(servo, recording, replayed(servo, recording))


class Tags(HTMLParser):
    """Collects what a page opens, refers to and leaves open."""

    VOID = ('meta', 'br', 'link', 'img')

    def __init__(self):
        super().__init__()
        self.opened, self.references = [], []

    def handle_starttag(self, tag, attributes):
        self.references += [v for k, v in attributes if k in ('src', 'href', 'xlink:href')]
        if tag not in self.VOID:
            self.opened.append(tag)

    def handle_endtag(self, tag):
        assert self.opened.pop() == tag


def test_it_refers_to_nothing_outside_itself(page):
    tags = Tags()
    tags.feed(re.sub(r'<(rect|line|path|polyline)\b([^>]*)/>', r'<\1\2></\1>', page))
    assert tags.opened == []
    assert tags.references == []
    assert 'http' not in page
    assert '@import' not in page and 'url(' not in page


def test_it_says_in_one_sentence_how_good_the_twin_is(page):
    said = re.search(r'<p class="sentence">(.*?)</p>', page).group(1)
    assert re.search(r'follows the load speed with R = -?\d', said)
    assert re.search(r'departs most in the load balance, [\d.]+ times the noise floor', said)


def test_it_colours_each_block_of_the_chain_by_its_balance(page):
    chain = re.search(r'<svg viewBox="0 0 \d+ 86".*?</svg>', page).group(0)
    blocks = dict(re.findall(r'<g class="(\w+)">.*?class="block"[^>]*>(\w+)<', chain))
    states = [(name, state) for state, name in
              re.findall(r'<g class="(\w+)">.*?class="block"[^>]*>(\w+)<', chain)]
    assert blocks and ('load', 'far') in states and ('command', 'fine') in states


@pytest.mark.skipif(found() is None, reason='no browser on this machine')
def test_a_phone_scrolls_a_chart_and_not_the_page(page, tmp_path):
    (tmp_path / 'page.html').write_text(page, 'utf8')
    browser = Browser(tmp_path / 'profile')
    try:
        browser.open(tmp_path / 'page.html', width=360)
        assert browser.run('document.documentElement.scrollWidth') == 360
        assert browser.run("document.querySelector('svg').getBoundingClientRect().width") == 760
    finally:
        browser.close()


def test_it_has_colours_for_light_and_dark(page):
    assert 'prefers-color-scheme: dark' in page
    assert 'name="color-scheme" content="light dark"' in page


def test_it_shows_every_channel_and_balance_that_was_measured(page):
    for title in ('load speed', 'load position', 'torque', 'current', 'transmission', 'motor'):
        assert f'<h3>{title}</h3>' in page


def test_it_holds_what_a_recording_says_of_itself_as_text(tmp_path):
    recording = bench_recording(0.3)
    evil = type(recording)('<script>x</script>', recording.period, recording.columns,
                           servo='a & b', family='"quoted"', warnings=('<b>bold</b>',))
    servo = load(SERVO)
    written = write_page(tmp_path / 'deep' / 'page.html', servo, evil, replayed(servo, evil),
                         warnings=evil.warnings)
    text = written.read_text('utf8')
    assert '<script' not in text and '<b>bold' not in text
    assert 'a &amp; b: &lt;script&gt;' in text


def test_a_chart_keeps_the_extremes_of_a_million_samples():
    time = np.arange(1_000_000) * 1e-3
    curve = np.zeros(len(time))
    curve[777_777] = 5.0
    chart = line_chart(time, {'rig': curve}, 'N m')
    assert len(chart) < 60_000
    heights = {float(point.split(',')[1]) for points in re.findall(r'points="([^"]*)"', chart)
               for point in points.split()}
    assert len(heights) == 2


def test_what_was_over_before_the_first_sample_is_left_out_of_the_events():
    events = [Happened(round(at * 1e9), '/rig/driver', kind, text) for at, kind, text in (
        (5.0, 'trouble', 'the bus is not open'), (6.0, 'trouble', 'no answer'),
        (8.0, 'over', 'the bus is not open'), (11.0, 'over', 'no answer'), (12.0, 'note', 'seen'))]
    assert [(row.at, row.kind, row.text) for row in rows_of(events, 10.0)] == [
        ('-4.00', 'trouble', 'no answer'), ('1.00', 'over', 'no answer'), ('2.00', 'note', 'seen')]


def test_a_chart_leaves_gaps_open():
    curve = np.sin(np.arange(100.0))
    curve[40:50] = np.nan
    assert line_chart(np.arange(100.0), {'rig': curve}, 'rad').count('<polyline') == 2


def test_a_chart_of_nothing_says_so():
    assert 'nothing was measured' in line_chart(np.arange(5.0), {'rig': np.full(5, np.nan)}, 'A')


@given(strategies.floats(-1e9, 1e9), strategies.floats(1e-6, 1e9), strategies.integers(2, 9))
def test_ticks_are_few_and_inside(low, span, most):
    high = low + span
    if high - low < 1e-9 * max(abs(low), abs(high)):
        return
    chosen = ticks(low, high, most)
    assert len(chosen) <= most + 1
    assert all(low - 1e-6 * span <= tick <= high + 1e-6 * span for tick in chosen)


def test_colours_tell_noise_from_departure():
    assert [colour(v) for v in (0.5, 3.0, 30.0, float('nan'))] == ['fine', 'off', 'far', 'unknown']
