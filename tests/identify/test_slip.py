"""A transmission that slips: the machine is solved backwards from the motion of its load."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained
from servo_twin.description import servo_file
from servo_twin.recording.recording import COLUMNS, Recording

PERIOD, SECONDS = 2e-3, 30.0
INERTIA, ROTOR, RATIO, STIFFNESS, LEVEL, CONSTANT, WEIGHT = 0.08, 2e-5, 6.0, 900.0, 0.4, 0.06, 5.0
BELT = servo_file.loads(f"""
servo: lifting belt
step: 1.0e-4
drive: {{type: current, gain: 1.0, torque_constant: {CONSTANT}}}
mechanism: {{type: two_inertia, rotor_inertia: {ROTOR}, load_inertia: {INERTIA}, ratio: {RATIO},
            stiffness: {STIFFNESS}, damping: 0.5}}
sensors:
  motor_encoder: {{noise: 2.0e-4}}
  load_encoder: {{noise: 1.0e-4}}
  current_sensor: {{noise: 0.02}}
effects:
  rubs: {{effect: coulomb_friction, at: load, level: {LEVEL}}}
  hangs: {{effect: constant_torque, at: load, torque: {-WEIGHT}}}
""")


def lifted(seed, slips):
    """Return a recording of a belt that loses ``slips(torque)``, a share of what it turns."""
    chance = np.random.default_rng(seed)
    time = np.arange(0.0, SECONDS, PERIOD)
    angle, speed, acceleration = np.zeros((3, len(time)))
    for rate, size in zip(chance.uniform(0.1, 1.2, 5), chance.uniform(0.5, 2.0, 5), strict=True):
        w, at = 2.0 * np.pi * rate, 2.0 * np.pi * rate * time + chance.uniform(0.0, 6.0)
        angle += size * np.sin(at)
        speed += size * w * np.cos(at)
        acceleration -= size * w**2 * np.sin(at)
    torque = INERTIA * acceleration + LEVEL * np.sign(speed) + WEIGHT
    lost = cumulative_trapezoid(slips(torque) * np.abs(speed), dx=PERIOD, initial=0.0)
    motor = RATIO * (angle + torque / STIFFNESS + lost)
    push = ROTOR * np.gradient(np.gradient(motor, PERIOD), PERIOD) + torque / RATIO
    seen = {name: np.full(len(time), np.nan) for name in COLUMNS}
    seen |= {'motor_position': motor + 2e-4 * chance.standard_normal(len(time)),
             'load_position': angle + 1e-4 * chance.standard_normal(len(time)),
             'current': push / CONSTANT + 0.02 * chance.standard_normal(len(time))}
    return Recording(f'lift {seed}', PERIOD, seen, family='lift', digest=f'{seed:064d}')


@pytest.mark.long
@pytest.mark.slow
def test_a_belt_that_creeps_is_named_with_what_it_loses():
    report = diagnose([lifted(seed, lambda torque: 4e-4 * torque) for seed in (1, 2, 3)],
                      BELT).report
    assert [one.effect for one in report.which] == ['slip']
    curve = report.which[0].curve
    assert np.interp(6.0, curve['x'], curve['y']) == pytest.approx(24e-4, rel=0.1)
    assert 'tighten the belt' in report.verdict['sentence']


def test_a_clutch_slips_beyond_its_torque_alone():
    def clutch(torque):
        return 0.02 * np.maximum(np.abs(torque) - 6.5, 0.0) * np.sign(torque)

    found = explained(residual_samples([lifted(seed, clutch) for seed in (1, 2)], BELT))
    assert [one.mechanism.name for one in found.chosen] == ['slip']


def test_a_belt_that_holds_lacks_nothing():
    found = explained(residual_samples([lifted(seed, np.zeros_like) for seed in (1, 2)], BELT))
    assert not found.chosen
