"""A motor that is turned slowly, whose current does little but hold it against its cogging."""

from __future__ import annotations

import numpy as np
import pytest

from servo_identify.diagnose.diagnose import diagnose
from servo_twin.description import servo_file
from servo_twin.recording.recording import COLUMNS, Recording

MOTOR = servo_file.loads("""
servo: outrunner
step: 5.0e-4
drive:
  type: current
  gain: {value: 1.0, unit: A/V, source: by definition}
  torque_constant: {value: 0.055, unit: N m/A, source: data sheet}
mechanism:
  type: rigid
  rotor_inertia: {value: 2.5e-4, unit: kg m2, source: data sheet}
  load_inertia: {value: 0.0, unit: kg m2, source: none}
  ratio: {value: 1.0, source: direct}
sensors:
  motor_encoder: {noise: 2.2e-4}
  current_sensor: {noise: 0.1}
effects:
  rubs: {effect: coulomb_friction, at: motor, level: {value: 0.0165, unit: N m, source: estimate}}
  drags:
    effect: viscous_friction
    at: motor
    slope: {value: 1.0e-4, unit: N m s/rad, source: estimate}
tolerance:
  drive.torque_constant: 20 %
  mechanism.rotor_inertia: 50 %
  effects.rubs.level: [0.0, 0.05]
  effects.drags.slope: [0.0, 5.0e-3]
""")


def turned(speed: float, seed: int) -> Recording:
    """Return one slow turn: the current that this motion needs, by the equation of the motor."""
    rng, period, whole = np.random.default_rng(seed), 2e-3, 2.0 * np.pi
    time = np.arange(round(whole / speed / period)) * period
    angle = speed * time + 2e-3 * np.sin(7.0 * speed * time + seed)
    rate, bend = np.gradient(angle, period), np.gradient(np.gradient(angle, period), period)
    cogs = 0.045 * np.sin(7.0 * angle + 0.4) + 0.02 * np.sin(28.0 * angle + 1.0)
    current = (2.5e-4 * bend + 0.017 + 1e-4 * rate - cogs) / 0.055
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['motor_position'] = angle + 2.2e-4 * rng.standard_normal(len(time))
    columns['current'] = current + 0.1 * rng.standard_normal(len(time))
    return Recording(f'turn_{seed}', period, columns, family=f'at {speed:g}', replicate=seed,
                     digest=f'{seed:064d}')


@pytest.mark.long
@pytest.mark.slow
def test_a_motor_that_loses_its_torque_does_not_stand_for_its_cogging():
    several = [turned(speed, seed) for speed, seeds in ((0.6, (1, 2, 3)), (0.2, (4,)))
               for seed in seeds]
    report = diagnose(several, MOTOR).report
    print(report.verdict['sentence'])
    first, = report.which
    named = {first.effect, *first.ambiguous_with}
    # one direction alone does not tell it from friction over the angle
    assert 'cogging' in named and named <= {'cogging', 'position_dependent_friction'}
