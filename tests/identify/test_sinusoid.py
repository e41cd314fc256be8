"""A sinusoid is recovered from its record alone, as well as noise allows."""

import json
from math import pi, remainder, sqrt

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.learn.sinusoid import recovered, SinusoidError
from servo_twin.bag import write_recording
from servo_twin.recording.recording import Recording

PERIOD = 1e-3


def record(frequency, phase, amplitude=1.0, offset=0.0, noise=0.0, seconds=10.0, seed=0):
    t = np.arange(round(seconds / PERIOD)) * PERIOD
    clean = offset + amplitude * np.sin(2.0 * pi * frequency * t + phase)
    return clean + noise * np.random.default_rng(seed).standard_normal(len(t))


def bounds_of(amplitude, noise, count):
    """Return the Cramer-Rao bounds of frequency, Hz, and of the phase at the first sample, rad."""
    # Rife and Boorstyn 1974, eq. 15 and 17: one real tone of many periods in white noise
    ratio = amplitude ** 2 / (2.0 * noise ** 2)
    frequency = sqrt(6.0 / (ratio * count * (count ** 2 - 1.0))) / (2.0 * pi * PERIOD)
    return frequency, sqrt(2.0 / (ratio * count)) * sqrt((2.0 * count - 1.0) / (count + 1.0))


@settings(max_examples=40, deadline=None)
@given(frequency=st.floats(0.3, 40.0), phase=st.floats(-3.1, 3.1),
       amplitude=st.floats(1e-3, 1e3), offset=st.floats(-2.0, 2.0), noise=st.floats(1e-3, 1.5),
       seed=st.integers(0, 2 ** 16))
def test_frequency_and_phase_in_noise_are_as_near_as_the_cramer_rao_bound_allows(
        frequency, phase, amplitude, offset, noise, seed):
    signal = record(frequency, phase, amplitude, offset * amplitude, noise * amplitude, seed=seed)
    found = recovered(signal, PERIOD)
    of_frequency, of_phase = bounds_of(1.0, noise, len(signal))
    assert abs(found.frequency - frequency) < 5.0 * of_frequency
    assert abs(remainder(found.phase - phase, 2.0 * pi)) < 5.0 * of_phase
    assert abs(found.amplitude / amplitude - 1.0) < 5.0 * noise * sqrt(2.0 / len(signal))
    assert found.residual == pytest.approx(noise * amplitude, rel=0.1)
    # the errors that it states are those of theory, few periods make them somewhat larger
    assert 0.8 < found.frequency_std / of_frequency < 1.6
    assert 0.8 < found.phase_std / of_phase < 1.6


@settings(max_examples=25, deadline=None)
@given(periods=st.floats(1.0, 3.0), phase=st.floats(-3.1, 3.1), offset=st.floats(-3.0, 3.0))
def test_a_clean_record_of_hardly_more_than_one_period_gives_all_four_numbers(
        periods, phase, offset):
    found = recovered(record(periods / 10.0, phase, 0.5, offset), PERIOD)
    assert found.frequency == pytest.approx(periods / 10.0, rel=1e-6)
    assert remainder(found.phase - phase, 2.0 * pi) == pytest.approx(0.0, abs=1e-5)
    assert found.amplitude == pytest.approx(0.5, rel=1e-5)
    assert found.offset == pytest.approx(offset, abs=1e-5)


@settings(max_examples=20, deadline=None)
@given(frequency=st.floats(0.4, 5.0), phase=st.floats(-3.1, 3.1), begin=st.integers(0, 3000),
       lost=st.floats(0.0, 0.4), seed=st.integers(0, 99))
def test_lost_samples_and_a_late_beginning_do_not_move_the_phase(frequency, phase, begin, lost,
                                                                 seed):
    signal = record(frequency, phase, noise=0.01)
    gone = np.random.default_rng(seed).random(len(signal)) < lost
    signal[gone] = np.nan
    signal[:begin] = np.nan
    found = recovered(signal, PERIOD)
    assert found.frequency == pytest.approx(frequency, abs=1e-3)
    assert remainder(found.phase - phase, 2.0 * pi) == pytest.approx(0.0, abs=0.02)


@settings(max_examples=20, deadline=None)
@given(frequency=st.floats(0.5, 4.0), phase=st.floats(-3.1, 3.1), width=st.floats(0.05, 0.5))
def test_the_plateaus_of_play_do_not_hide_the_frequency(frequency, phase, width):
    # the output of a gap of this width behind a sinusoid: it lags by what the gap takes
    wave, at, played = record(frequency, phase), 0.0, []
    for value in wave.tolist():
        at = min(max(at, value - 0.5 * width), value + 0.5 * width)
        played.append(at)
    assert recovered(np.array(played), PERIOD).frequency == pytest.approx(frequency, rel=5e-3)


@pytest.mark.parametrize('signal, words', [
    (np.ones(100), 'is constant'),
    (np.full(100, np.nan), 'has 0 samples that are numbers'),
    (np.arange(8.0), 'needs 16'),
    (record(0.05, 0.3), 'holds 0.50 periods'),
])
def test_a_record_without_a_sinusoid_is_refused_with_the_reason(signal, words):
    with pytest.raises(SinusoidError, match=words):
        recovered(signal, PERIOD)


def test_the_command_reads_any_column_of_any_bag(tmp_path, capsys):
    columns = {'voltage': record(3.0, 0.4, seconds=4.0),
               'load_position': record(3.0, -0.2, 0.1, 1.0, seconds=4.0)}
    bag = write_recording(tmp_path / 'bag', Recording('bag', PERIOD, columns))
    assert main(['sinusoid', str(bag), '--json', str(tmp_path / 'found.json')]) == 0
    assert 'bag, voltage: 3 Hz' in capsys.readouterr().out
    found, = json.loads((tmp_path / 'found.json').read_text())['sinusoids']
    assert found['bag'] == str(bag)
    assert found['phase'] == pytest.approx(0.4) and found['column'] == 'voltage'
    assert main(['sinusoid', str(bag), '--column', 'load_position', '--from', '1']) == 0
    assert 'phase -0.2 rad' in capsys.readouterr().out
    assert main(['sinusoid', str(bag), '--column', 'torque']) != 0
    assert "has no torque; it has ['voltage', 'load_position']" in capsys.readouterr().err
