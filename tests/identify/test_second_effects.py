"""A second effect beside the right one: not what its form is off, nor what it does itself."""

import numpy as np
import pytest
from test_selection import named_by_equations

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.mechanisms.hypothesis import Columns, EXTERNAL, Hypothesis, Mechanism
from servo_identify.diagnose.mechanisms.in_time import same_swing
from servo_twin.description import servo_file
from servo_twin.recording.recording import COLUMNS, Recording

INERTIA, LEVEL, SLOPE, CONSTANT, PERIOD = 0.25, 0.5, 0.02, 0.6, 5e-3
BRAKED = servo_file.loads(f"""
servo: braked wheel
step: 1.0e-3
drive: {{type: current, gain: 1.0, torque_constant: {CONSTANT}}}
mechanism: {{type: rigid, rotor_inertia: 1.0e-4, load_inertia: {INERTIA}, ratio: 1.0}}
sensors:
  motor_encoder: {{noise: 5.0e-4}}
  current_sensor: {{noise: 0.02}}
effects:
  c: {{effect: coulomb_friction, at: load, level: {LEVEL}}}
  v: {{effect: viscous_friction, at: load, slope: {SLOPE}}}
tolerance: {{mechanism.load_inertia: 8 %, effects.c.level: 20 %, effects.v.slope: 30 %}}
""")


def braked(seed, weight=0.0, brake=0.55, flying=0.0):
    """
    Return a wheel with a brake that falls off more slowly than eddy currents do.

    ``flying`` kg m2 is what flyweights add to its inertia at speed.
    """
    chance = np.random.default_rng(seed)
    time = np.arange(0.0, 40.0, PERIOD)
    angle, speed, acceleration = np.zeros((3, len(time)))
    for rate, peak in zip(chance.uniform(0.03, 0.4, 5), chance.uniform(4.0, 12.0, 5), strict=True):
        w, at = 2.0 * np.pi * rate, 2.0 * np.pi * rate * time + chance.uniform(0.0, 6.0)
        angle += peak / w * np.sin(at)
        speed += peak * np.cos(at)
        acceleration -= peak * w * np.sin(at)
    brake = brake * speed / (1.0 + (np.abs(speed) / 9.0) ** 1.75)
    inertia = INERTIA + flying * speed**2 / (speed**2 + 36.0)
    torque = inertia * acceleration + LEVEL * np.sign(speed) + SLOPE * speed + brake
    torque += weight * np.sin(angle)
    seen = {name: np.full(len(time), np.nan) for name in COLUMNS}
    seen |= {'motor_position': angle + 5e-4 * chance.standard_normal(len(time)),
             'current': torque / CONSTANT + 0.02 * chance.standard_normal(len(time))}
    return Recording(f'ride {seed}', PERIOD, seen, family='ride', digest=f'{seed:064d}')


@pytest.mark.long
@pytest.mark.slow
def test_a_brake_of_another_form_is_no_other_friction_beside_it():
    assert named_by_equations([braked(seed) for seed in (1, 2, 3)], BRAKED) == {
        ('eddy_brake', 'load')}


@pytest.mark.long
@pytest.mark.slow
def test_an_inertia_that_grows_with_speed_is_no_motor_that_weakens_there():
    several = [braked(seed, brake=0.0, flying=0.15) for seed in (1, 2, 3)]
    report = diagnose(several[:1], BRAKED, several[1:2], several[2:]).report
    (one,) = report.which
    assert (one.effect, one.site) == ('parameter:load_inertia', 'load')
    assert one.mechanism['variables'] == ['acceleration', 'speed']
    grown = 0.15 * np.square(one.curve['x']) / (np.square(one.curve['x']) + 36.0)
    assert np.sqrt(np.mean((np.array(one.curve['y']) - grown) ** 2)) < 0.1 * 0.15
    assert 'load inertia (0.25' in report.verdict['sentence']


def hosed(seed, level=1.2, travel=0.3):
    """Return a joint with a bundle of hoses that drag by Dahl's equation, in steps of Euler."""
    chance, finer = np.random.default_rng(seed), 20
    step = PERIOD / finer
    time = np.arange(0.0, 30.0, step)
    angle, speed, acceleration, drag = np.zeros((4, len(time)))
    for rate, swing in zip(chance.uniform(0.05, 0.6, 4), chance.uniform(0.2, 0.9, 4), strict=True):
        w, at = 2.0 * np.pi * rate, 2.0 * np.pi * rate * time + chance.uniform(0.0, 6.0)
        angle += swing * np.sin(at)
        speed += swing * w * np.cos(at)
        acceleration -= swing * w**2 * np.sin(at)
    for k in range(1, len(time)):
        drag[k] = drag[k - 1] + step * speed[k] / travel * (1.0 - np.sign(speed[k]) * drag[k - 1])
    torque = INERTIA * acceleration + LEVEL * np.sign(speed) + SLOPE * speed + level * drag
    seen = {name: np.full(len(time[::finer]), np.nan) for name in COLUMNS}
    rows = len(seen['current'])
    seen |= {'motor_position': angle[::finer] + 5e-4 * chance.standard_normal(rows),
             'current': torque[::finer] / CONSTANT + 0.02 * chance.standard_normal(rows)}
    return Recording(f'hose {seed}', PERIOD, seen, family='hose', digest=f'{seed:064d}')


@pytest.mark.long
@pytest.mark.slow
def test_what_drags_over_a_long_travel_after_each_reversal_has_its_level_and_travel():
    several = [hosed(seed) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], BRAKED, several[1:2], several[2:])
    assert [(one.effect, one.site) for one in answer.report.which] == [
        ('presliding_friction', 'load')]
    values = {name.rpartition('.')[2]: value['value']
              for name, value in answer.report.which[0].parameters.items()}
    assert (values['level'], values['travel']) == pytest.approx((1.2, 0.3), rel=0.05)
    assert answer.report.gap['solved'] > 0.8


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('named', [1, 3])
def test_a_second_effect_that_comes_and_goes_with_the_recordings_is_a_warning(monkeypatch, named):
    several = [braked(seed, weight=0.4) for seed in (1, 2, 3)]

    def halves(found):
        brake, weight = (next(h.mechanism for h in found.chosen if h.mechanism.name == name)
                         for name in ('eddy_brake', 'gravity'))
        both = {brake.key: brake, weight.key: weight}
        return [both] * named + [{brake.key: brake}] * (4 - named)

    monkeypatch.setattr('servo_identify.diagnose.diagnose.halves', halves)
    report = diagnose(several[:1], BRAKED, several[1:2], several[2:]).report
    told = 'gravity' in {one.effect for one in report.which}
    warned = any(one.startswith('Gravity at the load shaft may act too: 25 %')
                 for one in report.warnings)
    assert (told, warned) == (named == 3, named == 1)
    assert report.stability['named_in']['gravity'] == named / 4
    assert 'eddy_brake' in {one.effect for one in report.which}


@pytest.mark.parametrize(('tone', 'same'), [(0.331, True), (0.36, False)])
def test_a_wave_at_the_frequency_of_a_payload_is_its_swing(tone, same):
    def one(name, variable, frequency):
        mechanism = Mechanism(name, 'torque', 'load', (variable,), 'even')
        return Hypothesis(mechanism, Columns(np.ones((4, 1))), np.zeros(1), knots=(frequency,))

    wave, swing = one(EXTERNAL, 'time', tone), one('payload_resonance', 'acceleration', 0.335)
    assert same_swing(wave, swing, 60.0) is same_swing(swing, wave, 60.0) is same
    assert not same_swing(swing, swing, 60.0)
    assert not same_swing(one(EXTERNAL, 'coupled angle', tone), swing, 60.0)
