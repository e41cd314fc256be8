"""Recordings of different motions, of which none drifts: the check ..."""

from pathlib import Path

import numpy as np
import pytest

from servo_identify.data.apart import Chance, most_apart
from servo_identify.data.pooled import Columns, pooled
from servo_identify.data.recording_check import check
from servo_twin.description.servo_file import load
from servo_twin.recording.recording import COLUMNS, Recording

CONFIG = Path(__file__).resolve().parents[2] / 'config' / 'servos'


def moved(servo, number, size, lag, friction, family='', place=0.0):
    """Return a joint that moves by ``size``, with a ``friction`` of speed and torque."""
    time, chance = np.arange(8000) * 1e-3, np.random.default_rng(number)
    values = servo.values
    ratio = values['mechanism.ratio']
    angle, speed, acceleration = (
        size * sum(part * rate**order * of(rate * time / lag + number) / lag**order * sign
                   for part, rate in ((0.3, 12.0), (0.14, 9.0), (0.07, 3.1)))
        for order, of, sign in ((0, np.sin, 1.0), (1, np.cos, 1.0), (2, np.sin, -1.0)))
    torque = values['mechanism.load_inertia'] * acceleration + place * np.sin(3.0 * angle)
    torque = torque + friction(speed, torque)
    nothing = {name: np.full(len(time), np.nan) for name in COLUMNS}
    drawn = torque + values['mechanism.rotor_inertia'] * ratio**2 * acceleration
    seen = {'motor_position': ratio * angle, 'load_position': angle, 'torque': torque,
            'current': drawn / ratio / values['drive.torque_constant']}
    return Recording(f'run_{number}', 1e-3, {**nothing, **{
        name: column + 1e-4 * np.std(column) * chance.standard_normal(len(time))
        for name, column in seen.items()}}, family=family)


def servo_of(**values):
    return load(CONFIG / 'rv_bench.yaml').with_values(values)


def differing(several, servo):
    return [one for one in check(several, servo) if 'differs between' in one.sentence]


@pytest.mark.parametrize('level', [2.0, 20.0])
def test_friction_that_grows_with_the_load_is_no_friction_that_drifts(level):
    servo = servo_of()
    several = [moved(servo, k, size, lag, lambda speed, torque: np.sign(speed) * (
        level + 0.1 * np.abs(torque))) for k, (size, lag) in enumerate(
            ((1.0, 1.0), (0.5, 2.0), (2.0, 1.5), (0.7, 1.0)))]
    assert not differing(several, servo)


def of_other_ranges(seed):
    """Return motions of several ranges, of which the fit lacks what bends at one place."""
    chance, time, made = np.random.default_rng(seed), np.arange(3000) * 1e-3, []
    for size in (2.0, 1.4, 0.5, 0.3):
        place = size * (np.cos(3.1 * time + seed) + 0.3 * np.cos(1.3 * time))
        seen = 2.0 * place + np.maximum(place - 0.4, 0.0) + 0.02 * chance.standard_normal(3000)
        made.append(Columns(seen, place[:, None], np.ones((3000, 1))))
    return made


def test_what_an_equation_lacks_is_seldom_taken_for_a_zero_that_differs():
    chance = Chance('abcd', 5.0, 0.0, np.zeros(4))
    told = [most_apart(*pooled(of_other_ranges(seed), 10).apart([1.0]), chance)
            for seed in range(12)]
    assert sum(one is not None for one in told) < 5
