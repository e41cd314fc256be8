"""The page of a diagnosis in a real browser: hover, zoom, choose and copy."""

from copy import deepcopy
import re

from diagnosis_document import BARE, document, HOSTILE, hostile_document
from headless_chromium import Browser, found, NAMES
import numpy as np
from page_labels import OVERLAPS, RECORD_LABELS, TICKS
import pytest

from servo_identify.diagnose.page.page import write_page


@pytest.fixture(scope='module')
def browser(tmp_path_factory):
    if found() is None:
        pytest.skip(f'no browser on this machine: none of {", ".join(NAMES)} is on the PATH')
    one = Browser(tmp_path_factory.mktemp('profile'))
    one.before_any_page(RECORD_LABELS)
    yield one
    one.close()


@pytest.fixture(scope='module')
def full(tmp_path_factory):
    return write_page(document(), tmp_path_factory.mktemp('pages') / 'deep' / 'page.html')


def middle_of(browser, selector: str, share: float = 0.5) -> tuple[float, float]:
    """Scroll to an element and return a point of it in px of the window."""
    return browser.run(f"""(() => {{
      const one = document.querySelectorAll({selector!r})[0];
      one.scrollIntoView({{block: 'center'}});
      const r = one.getBoundingClientRect();
      return [r.left + {share} * r.width, r.top + r.height / 2]; }})()""")


def test_the_browser_reads_the_samples_that_were_written(browser, full):
    browser.open(full)
    there = browser.run("seriesOf('sweep_1')")
    written = document()['series'][1]
    assert np.allclose(there['t'], written['t'], atol=1e-6)
    for name, channel in written['channels'].items():
        for side in ('rig', 'as_given', 'augmented'):
            read = np.array(there['channels'][name][side], dtype=float)
            assert np.allclose(read, channel[side], atol=0.1 * channel['noise'], equal_nan=True)


@pytest.mark.parametrize(('width', 'dark'), [(360, False), (1400, False), (1400, True)])
def test_no_label_lies_over_another_and_no_axis_has_a_single_tick(browser, full, width, dark):
    browser.open(full, width, dark=dark)
    assert browser.run(OVERLAPS) == []
    ticks = browser.run(TICKS)
    assert len(ticks) >= 8
    assert [t for t in ticks if t['x'] < 2 or (t['y'] < 2 and not t['small'])] == []
    for move in ('in', 'in', 'worst'):
        browser.run(f"document.querySelector('[data-window={move}]').click()")
        browser.settle()
        assert browser.run(OVERLAPS) == []
        assert all(t['x'] >= 2 and (t['y'] >= 2 or t['small']) for t in browser.run(TICKS))
    assert browser.errors == [] and browser.requests == [full.as_uri()]
    browser.run("document.querySelector('h2').style.marginTop = '-3rem'")
    assert browser.run(OVERLAPS) != []
    paper = browser.run('getComputedStyle(document.body).backgroundColor')
    assert paper == ('rgb(20, 23, 27)' if dark else 'rgb(251, 250, 247)')


@pytest.mark.parametrize('values', [8, 12, 25])
@pytest.mark.parametrize('width', [360, 1400])
def test_many_correlations_lie_over_nothing_and_are_not_cut_off(browser, tmp_path, values, width):
    one = document()
    names = [f'effects.of_some_length_{k}.level' for k in range(values)]
    one['correlations'] = {'names': names, 'matrix': np.where(
        np.eye(values), 1.0, -0.93).tolist()}
    browser.open(write_page(one, tmp_path / 'page.html'), width)
    assert browser.run(OVERLAPS) == []
    assert browser.run("""(() => { const box = document.querySelector('table.heat').parentElement;
        return box.scrollWidth <= box.clientWidth + 1; })()""")


@pytest.fixture(scope='module')
def small(tmp_path_factory):
    """Return the page of an effect that is small, with values of long names and units."""
    one = deepcopy(document())
    cause = one['report']['which'][0]
    for name in ('y', 'low', 'high'):
        cause['curve'][name] = [value / 8000.0 for value in cause['curve'][name]]
    cause.pop('points', None)
    cause['parameters'] = {'slope of viscous friction motor': {
        'value': -2.537e-4, 'std': 1.291e-4, 'unit': 'N m s/rad'}}
    one['report']['channels']['motor_position'] = {
        'unit': 'rad', 'rms_gap': 0.0304, 'as_given': 0.0304, 'within_tolerance': 0.0304,
        'augmented': 5.16e-4, 'noise_floor': 8.86e-4, 'fit': 0.9}
    return write_page(one, tmp_path_factory.mktemp('small') / 'page.html')


def test_no_table_is_cut_off_on_a_phone(browser, small):
    browser.open(small, 360)
    assert browser.run("""[...document.querySelectorAll('.scroll')].filter(
        one => one.scrollWidth > one.clientWidth + 1).map(one => one.innerText)""") == []


def test_a_curve_is_headed_by_the_unit_of_its_axis(browser, small):
    browser.open(small)
    said = browser.run("document.querySelector('.curve').closest('figure').innerText")
    assert said.startswith('mN m over load speed') and re.search(r'curve\s*[\d.]+ mN m', said)


def test_it_shows_the_values_under_the_mouse_in_every_plot(browser, full):
    browser.open(full)
    browser.mouse('Moved', *middle_of(browser, '#plots .u-over'))
    browser.settle()
    said = browser.run("[...document.querySelectorAll('#plots .u-legend')].map(l => l.innerText)")
    assert len(said) == 6
    for legend in said:
        assert len(re.findall(r'\d (s|µrad|mrad|rad|N m)', legend)) >= 3, legend
    browser.mouse('Moved', *middle_of(browser, '.curve .u-over', 0.8))
    browser.settle()
    said = browser.run("document.querySelector('.curve .u-legend').innerText")
    assert re.search(r'curve\s*2[0-9.]+ N m', said), said


def test_a_curve_reads_its_right_end_until_one_points_at_it(browser, full):
    browser.open(full)
    legend = "document.querySelector('.curve .u-legend').innerText"
    rest = browser.run(legend)
    assert len(re.findall(r'\d (rad|N m)', rest)) == 4, rest
    browser.mouse('Moved', *middle_of(browser, '.curve .u-over', 0.3))
    browser.settle()
    assert browser.run(legend) != rest
    browser.mouse('Moved', *middle_of(browser, 'h1'))
    browser.settle()
    assert browser.run(legend) == rest


@pytest.mark.parametrize('width', [*range(300, 420, 10), 1400])
def test_an_option_of_a_command_does_not_break_across_lines(browser, tmp_path, width):
    one = document()
    said = 'Gravity (4.03 +- 0.2 N m at most). Moving other values would remove 90 % (--refit).'
    one['report']['verdict'] |= {'sentence': said, 'remains': f'{said} --despite-check'}
    one['report']['warnings'] = [f'{HOSTILE} --despite-check']
    browser.open(write_page(one, tmp_path / 'page.html'), width)
    assert browser.run("""[...document.querySelectorAll('h1 code, p code, li code')]
        .map(one => [one.innerText, one.getClientRects().length])""") == [
            ['--refit', 1], ['--refit', 1], ['--despite-check', 1], ['--refit', 1],
            ['--despite-check', 1]]
    text = browser.run("document.querySelector('h1').innerText")
    assert '(4.03\xa0+-\xa00.2 N m' in text and 'remove 90\xa0% (' in text
    assert browser.run('window.hacked === undefined')


def test_a_zoom_of_one_plot_zooms_all(browser, full):
    browser.open(full)
    scales = 'plots.map(p => [p.scales.x.min, p.scales.x.max])'
    whole = browser.run(scales)
    start, end = (middle_of(browser, '#plots .u-over', share) for share in (0.25, 0.5))
    browser.mouse('Moved', *start)
    browser.mouse('Pressed', *start, button='left', buttons=1, clickCount=1)
    browser.mouse('Moved', *end, button='left', buttons=1)
    browser.mouse('Released', *end, button='left', clickCount=1)
    browser.settle()
    zoomed = browser.run(scales)
    assert zoomed == [zoomed[0]] * 6
    assert zoomed[0] == pytest.approx([3.0, 6.0], abs=0.1)
    assert float(browser.run("one('from').value")) == pytest.approx(zoomed[0][0], abs=0.01)
    for count in (1, 2):
        browser.mouse('Pressed', *start, button='left', buttons=1, clickCount=count)
        browser.mouse('Released', *start, button='left', clickCount=count)
    browser.settle()
    assert browser.run(scales) == whole
    browser.call('Emulation.setTouchEmulationEnabled', enabled=True)
    for kind, shares in (('Start', (0.4, 0.6)), ('Move', (0.2, 0.8))):
        points = [dict(zip('xy', middle_of(browser, '#plots .u-over', s), strict=True))
                  for s in shares]
        browser.call('Input.dispatchTouchEvent', type=f'touch{kind}', touchPoints=points)
    browser.call('Input.dispatchTouchEvent', type='touchEnd', touchPoints=[])
    browser.call('Emulation.setTouchEmulationEnabled', enabled=False)
    pinched = browser.run(scales)
    assert pinched == [pinched[0]] * 6
    assert pinched[0] == pytest.approx([4.0, 8.0], abs=0.1)
    browser.run("one('from').value = '2,5'; one('to').value = '4'; one('to').onchange()")
    assert browser.run(scales) == [[2.5, 4.0]] * 6
    browser.run("one('to').value = 'soon'; one('to').onchange()")
    assert browser.run(scales) == [[2.5, 4.0]] * 6 and browser.run("one('to').value") == '4'


def test_recording_and_channel_are_chosen(browser, full):
    browser.open(full)
    browser.run("one('recording').value = 'load_steps_2'; "
                "one('recording').dispatchEvent(new Event('change'))")
    assert browser.run('state.recording') == 'load_steps_2'
    titles = "[...document.querySelectorAll('#plots h3')].map(t => t.textContent)"
    assert 'current, A' not in browser.run(titles)
    browser.run("[...document.querySelectorAll('#channels button')]"
                ".find(b => b.textContent === 'current').click()")
    assert 'current, A' in browser.run(titles)
    assert browser.errors == []


def test_what_can_be_copied_is_copied_whole(browser, full):
    browser.call('Browser.grantPermissions',
                 permissions=['clipboardReadWrite', 'clipboardSanitizedWrite'])
    browser.open(full)
    for place, text in (('patch-text', document()['patch']),
                        ('command-next',
                         document()['report']['next_experiment']['command'])):
        at = middle_of(browser, f'[data-copy={place}]')
        browser.mouse('Pressed', *at, button='left', buttons=1, clickCount=1)
        browser.mouse('Released', *at, button='left', clickCount=1)
        browser.settle()
        assert browser.run(f"document.querySelector('[data-copy={place}]').textContent"
                           ) == 'copied'
        assert browser.run('navigator.clipboard.readText()') == text


def test_every_status_and_every_gap_in_the_document_draws_without_an_error(browser, tmp_path):
    sparse = document('no_gap')
    sparse['series'][3]['channels'] = {'torsion': {'rig': [], 'as_given': []}}
    sparse['equations'] = []
    flat = deepcopy(document('unknown'))
    for channel in flat['series'][3]['channels'].values():
        channel['rig'] = [1.0] * len(channel['rig'])
        channel['as_given'] = [None] * len(channel['rig'])
    no_series = {**document('explained'), 'series': []}
    for k, one in enumerate((document('explained'), sparse, flat, no_series, BARE,
                             hostile_document())):
        path = write_page(one, tmp_path / f'{k}.html')
        browser.open(path, 1400 if k % 2 else 360)
        assert browser.errors == [], k
        assert browser.requests == [path.as_uri()]
        assert browser.run('window.hacked') is None
        assert browser.run(OVERLAPS) == [], k
