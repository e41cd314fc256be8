"""The elementary functions and networks that laws use, against higher precision."""

from __future__ import annotations

from numba import njit
import numpy as np
import pytest

from servo_twin.physics.delay_line import delayed, ROOM
from servo_twin.physics.elementary_functions import cos_sin, exp, fused, tanh
from servo_twin.physics.harmonics import wave
from servo_twin.physics.network import two_layers

EXACT = np.longdouble


def test_a_fused_sum_is_rounded_once():
    compiled, small = njit(lambda a, b, c: fused(a, b, c)), 2.0**-52
    assert compiled(1.0 + small, 1.0 + small, -1.0 - 2.0 * small) == small**2


def test_exp_is_good_to_the_last_digits_and_stands_still_far_out():
    x = np.concatenate([np.linspace(-700.0, 700.0, 5001), np.linspace(-1.0, 1.0, 2001)])
    exact = np.exp(x.astype(EXACT))
    assert np.abs(np.array([exp(v) for v in x]) / exact - 1.0).max() < 1e-15
    assert exp(0.0) == 1.0
    assert exp(-1e9) == exp(-700.0) and exp(1e9) == exp(700.0)


def test_tanh_is_good_to_the_last_digits_everywhere():
    x = np.concatenate([np.linspace(-25.0, 25.0, 5001), np.logspace(-300, 1, 2000),
                        -np.logspace(-12, 2, 2000)])
    exact = np.tanh(x.astype(EXACT))
    mine = np.array([tanh(v) for v in x])
    assert np.abs((mine - exact) / np.where(exact == 0.0, 1.0, exact)).max() < 1e-15


@pytest.mark.parametrize('farthest', [1.0, 1e3, 1e6])
def test_cosine_and_sine_are_good_to_the_last_digits(farthest):
    x = np.random.default_rng(1).uniform(-farthest, farthest, 5000)
    mine = np.array([cos_sin(v) for v in x])
    assert np.abs(mine[:, 0] - np.cos(x.astype(EXACT))).max() < 1e-15
    assert np.abs(mine[:, 1] - np.sin(x.astype(EXACT))).max() < 1e-15


@pytest.mark.parametrize('function', [exp, tanh])
def test_what_is_not_a_number_stays_none(function):
    assert np.isnan(function(np.nan))


def test_a_wave_is_the_sum_of_its_harmonics():
    noise = np.random.default_rng(2)
    cosine, sine, phase, i = noise.normal(size=20), noise.normal(size=20), 1.234, np.arange(1, 21)
    assert wave(cosine, sine, phase) == pytest.approx(
        cosine @ np.cos(i * phase) + sine @ np.sin(i * phase), abs=1e-12)


@pytest.mark.parametrize('nodes', [1, 5, 30, 32, 33, 70])
def test_a_network_is_the_sum_of_its_nodes(nodes):
    noise = np.random.default_rng(nodes)
    w1, w2, threshold, v = noise.normal(size=(4, nodes))
    mine = two_layers(w1, w2, threshold, v, 0.3, -0.7, np.zeros(32))
    assert mine == pytest.approx(v @ np.tanh(0.3 * w1 - 0.7 * w2 - threshold), abs=1e-13)


@pytest.mark.parametrize('delay', [0.0, 1e-4, 3.7e-4, 1e-3, 0.02, 0.3])
def test_a_delayed_ramp_is_the_ramp_of_before(delay):
    s, h = np.zeros(ROOM), 1e-4
    late = np.array([delayed(s, k * h, delay, h) for k in range(8000)])
    at = np.arange(8000) * h - delay
    assert late == pytest.approx(np.maximum(at, 0.0), abs=1e-12 if delay < 0.025 else 2e-3)
    assert late[4000:] == pytest.approx(at[4000:], abs=1e-12)
