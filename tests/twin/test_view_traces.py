"""What the live view keeps of a rig, and what of it reaches a browser: it ..."""

import json
from math import isnan

import numpy as np
import pytest

from servo_twin.description.servo_file import load
from servo_twin.description.shipped import servo_at
from servo_twin.view.looker import Looker
from servo_twin.view.spectrum import spectrum
from servo_twin.view.traces import NAMES, Traces, units

PERIOD = 1e-3


def put(traces, sequence, values, part='encoder', name='load_position', period=PERIOD):
    stamp = 10**9 + round(sequence * period * 1e9)
    traces.put(part, sequence, stamp, period, {name: np.asarray(values, float)})


def unpacked(message: bytes) -> tuple[dict, np.ndarray]:
    size = int.from_bytes(message[:4], 'little')
    head = json.loads(message[4:4 + size])
    values = np.frombuffer(message[4 + size:], np.float32)
    return head, values.reshape(len(head['names']), 2, head['count'])


def test_it_keeps_the_last_seconds_whatever_the_blocks():
    traces = Traces(1.0)
    for k in range(0, 2500, 7):
        put(traces, k, np.arange(k, k + 7))
    (kept,) = traces.read(['load_position'], traces.end - 1000, traces.end)
    assert np.array_equal(kept, np.arange(traces.end - 1000, traces.end))
    assert traces.size == 1000
    assert np.isnan(traces.read(['load_position'], 0, 10)).all()


def test_what_was_lost_is_not_known_and_what_came_before_is_not_shown_in_its_place():
    traces = Traces(1.0)
    for k in range(0, 1000, 10):
        put(traces, k, np.full(10, 7.0))
    put(traces, 1500, np.full(10, 8.0))
    (kept,) = traces.read(['load_position'], 990, 1510)
    assert np.isnan(kept[10:510]).all() and (kept[510:] == 8.0).all()


def test_it_begins_again_with_a_driver_that_does():
    traces = Traces(1.0)
    put(traces, 5000, np.ones(10))
    put(traces, 5000, np.ones(10), 'twin/prediction', 'twin.torque')
    before = traces.generation
    put(traces, 0, np.full(10, 2.0))
    assert traces.generation == before + 1 and traces.end == 10
    put(traces, 5010, np.ones(10), 'twin/prediction', 'twin.torque')  # of the run before
    assert traces.end == 10


def test_it_waits_for_a_twin_that_answers_and_for_no_other():
    traces = Traces(5.0)
    put(traces, 0, np.ones(100))
    put(traces, 0, np.ones(60), 'twin/residual', 'balance.load')
    assert traces.settled() == 60
    put(traces, 100, np.ones(1000))
    assert traces.settled() == 1100


def test_it_sends_no_more_than_the_pixels_and_leaves_no_peak_out():
    traces = Traces(10.0)
    looker = Looker()
    looker.show({'names': ['load_position'], 'span': 10.0, 'pixels': 500})
    values = np.zeros(10_000)
    values[7321] = 5.0
    for k in range(0, 10_000, 100):
        put(traces, k, values[k:k + 100])
    head, got = unpacked(looker.traces(traces))
    assert head['whole'] and head['bucket'] == 32 and head['count'] <= 500
    assert got[0, 1].argmax() + head['first'] == 7321 // 32
    assert got[0, 1].max() == 5.0 and got[0, 0].max() == 0.0
    assert looker.traces(traces) is None
    put(traces, 10_000, np.ones(100))
    head, got = unpacked(looker.traces(traces))
    assert not head['whole'] and head['first'] == 312 and head['count'] == 10_100 // 32 - 312


def test_it_says_facts_once():
    looker = Looker()
    assert json.loads(looker.facts({'a': 1, 'b': 2})) == {'facts': {'a': 1, 'b': 2}}
    assert json.loads(looker.facts({'a': 1, 'b': 3})) == {'facts': {'b': 3}}
    assert looker.facts({'a': 1, 'b': 3}) is None


@pytest.mark.parametrize('wanted', [
    {'names': 'load_position'}, {'names': ['nonsense', 3], 'span': 'long', 'pixels': None},
    {'span': float('inf'), 'pixels': -3, 'spectrum': ['x']}, {'span': 10**400}, {}])
def test_it_passes_over_what_a_page_cannot_ask_for(wanted):
    traces, looker = Traces(1.0), Looker()
    put(traces, 0, np.ones(100))
    looker.show(wanted)
    assert looker.traces(traces) is None
    assert looker.density(traces) is None


def test_the_level_of_a_balance_is_its_rms_over_the_last_second():
    traces = Traces(5.0)
    put(traces, 0, np.ones(2000))
    put(traces, 0, np.full(1000, 50.0), 'twin/residual', 'balance.motor')
    put(traces, 1000, np.where(np.arange(1000) % 2, 3.0, -3.0), 'twin/residual', 'balance.motor')
    assert traces.levels() == pytest.approx({'motor': 3.0})


@pytest.mark.parametrize('size', [1e200, np.inf])
def test_it_tells_a_page_no_infinite_number_of_a_twin_that_ran_away(size):
    traces, looker = Traces(5.0), Looker()
    put(traces, 0, np.ones(2000))
    put(traces, 0, size * np.ones(2000), 'twin/residual', 'balance.load')
    put(traces, 0, np.where(np.arange(2000) % 2, size, -size), 'twin/prediction',
        'twin.load_position')
    looker.show({'names': ['twin.load_position'], 'spectrum': 'twin.load_position'})
    assert np.isfinite(unpacked(looker.traces(traces))[1]).all()
    for said in (looker.density(traces), looker.facts({'levels': traces.levels()})):
        json.loads(said, parse_constant=lambda name: pytest.fail(f'{name} is no JSON'))


def test_a_sine_stands_in_the_spectrum_at_its_frequency():
    time = np.arange(8000) * PERIOD
    values = 2.0 * np.sin(2.0 * np.pi * 60.0 * time)
    values[:100] = values[-20:] = np.nan
    frequency, density = spectrum(values, PERIOD)
    assert frequency[density.argmax()] == pytest.approx(60.0, rel=0.02)
    # a Hann window of 2 s: a line of amplitude a is a sqrt(2 / (2 * 1.5)) * sqrt(2) high
    assert density.max() == pytest.approx(2.0 * np.sqrt(2.0 / 3.0), rel=0.02)
    assert len(spectrum(values[:150], PERIOD)[0]) == 0
    assert len(spectrum(np.full(500, np.nan), PERIOD)[0]) == 0


def test_every_name_has_a_place_of_its_own():
    assert len(set(NAMES)) == len(NAMES)
    traces = Traces(1.0)
    put(traces, 0, [1.0], name='twin.torque')
    assert isnan(traces.read(['torque'], 0, 1)[0, 0])


def test_its_units_are_those_of_an_axis_that_moves_straight():
    known = units(load(servo_at('emps')))
    assert [known[name] for name in (
        'load_position', 'gap.motor_position', 'twin.torque', 'current', 'balance.load')] == [
        'm', 'm', 'N', 'A', '× noise']
    assert set(NAMES) <= set(known)
    assert units(None)['torque'] == units(load(servo_at('rv_bench')))['torque'] == 'N m'
