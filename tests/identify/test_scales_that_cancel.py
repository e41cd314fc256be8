"""A gain and a torque constant that make up for each other: no machine has one of them gone."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recordings import sampled
from test_selection import named_by_equations

from servo_identify.diagnose.mechanisms.builder import Builder
from servo_identify.diagnose.mechanisms.every_hypothesis import hypotheses_of
from servo_identify.diagnose.residuals.nuisance import value_of
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

ELBOW = servo_file.loads("""
servo: cobot_elbow
step: 2.0e-4
drive: {type: current, gain: 1.0, torque_constant: 1.0}
mechanism: {type: rigid, rotor_inertia: 0.0, load_inertia: 0.42, ratio: 1.0}
sensors: {motor_encoder: {noise: 6.0e-6}}
effects:
  rubs: {effect: coulomb_friction, at: load, level: 2.0}
  oil: {effect: viscous_friction, at: load, slope: 0.95}
  arm: {effect: gravity, at: load, cosine: 0.0, sine: -3.55}
tolerance:
  drive.torque_constant: 2 %
  mechanism.load_inertia: 5 %
  effects.rubs.level: 15 %
  effects.oil.slope: 20 %
  effects.arm.sine: 4 %
""")
LUGRE = ELBOW.with_values({'effects.rubs.level': 0.0}).with_effects(
    Placed('bristles', find('presliding_friction'), 'load'),
    Placed('rises', find('stribeck_friction'), 'load'), values={
        'effects.bristles.level': 2.05, 'effects.bristles.breakaway': 4.8e-3,
        'effects.rises.excess': 1.4, 'effects.rises.fade': 0.07})


def effort_alone(rig, seed):
    """Return a recording of a joint whose effort is the command: no current beside it."""
    time = np.arange(9000) * 2e-3
    effort = sum(size * np.sin(2.0 * np.pi * f * time + seed + f)
                 for size, f in ((4.0, 0.21), (3.0, 0.53), (1.5, 1.7)))
    one = sampled(rig, effort, seed=seed, period=2e-3)
    gone = np.full(len(time), np.nan)
    return replace(one, name=f'move_{seed}', family='move', columns={
        **one.columns, 'load_position': gone, 'torque': gone, 'current': gone})


def test_no_scale_of_the_drive_turns_round_or_vanishes():
    samples = residual_samples([effort_alone(ELBOW, 1)], ELBOW)
    several = [one for one in hypotheses_of(Builder(samples), samples.base)
               if one.mechanism.name in ('parameter:gain', 'torque_constant_error')]
    assert len(several) > 2
    for one in several:
        low, high = (np.min(edge) for edge in one.room)
        if 'of' in one.detail or one.path:
            low, high = (value_of(samples, one.path or one.detail['of'], float(edge))
                         for edge in (low, high))
            assert 0.0 < low < 1.0 < high < np.inf
        else:
            assert -1.0 < np.max(one.room[0]) < 0.0 < high < np.inf


def test_a_value_that_changes_with_speed_is_that_of_the_file_at_rest():
    samples = residual_samples([effort_alone(ELBOW, 1)], ELBOW)
    several = [one for one in hypotheses_of(Builder(samples), samples.base)
               if one.form is not None and one.form.variable == 'speed' and 'is' in one.detail]
    assert {one.detail['of'] for one in several} == {'drive.torque_constant',
                                                     'mechanism.load_inertia'}
    for one in several:
        assert not one.form.shape(np.zeros(1)).any()
        assert one.form.shape(np.array([one.knots[-1]])).any()


@pytest.mark.long
@pytest.mark.slow
def test_friction_that_sticks_is_none_of_a_drive_without_gain():
    found = named_by_equations([effort_alone(LUGRE, seed) for seed in (1, 2)], ELBOW)
    assert ('presliding_friction', 'load') in found
    assert {site for _, site in found} == {'load'}
