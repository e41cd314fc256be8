"""A current that its logger writes rows too late, where the command tells what it was."""

import numpy as np
import pytest
from synthetic_recordings import run_of

from servo_identify.diagnose.decisions import SAMPLING
from servo_identify.diagnose.diagnose import diagnose
from servo_twin.description import servo_file

PERIOD, FINE, LATE, NOISE = 2e-3, 40, 2, 0.05
INERTIA, CONSTANT, RATIO, RUBS = 0.08, 0.1, 10.0, 0.4
COUNT = 2.0 * np.pi / 8192
SERVO = servo_file.loads(f"""
servo: knee
drive: {{type: current, gain: 1.0, torque_constant: {CONSTANT}}}
mechanism: {{type: rigid, rotor_inertia: 0.0002, load_inertia: {INERTIA}, ratio: {RATIO}}}
sensors:
  motor_encoder: {{noise: {COUNT / np.sqrt(12.0)}}}
  current_sensor: {{noise: {NOISE}}}
effects:
  rubs: {{effect: coulomb_friction, at: load, level: {RUBS}}}
tolerance:
  mechanism.load_inertia: 5 %
  effects.rubs.level: 15 %
""")


def recorded(seed, seconds=14.0):
    """An impedance controller jumps between places; the current is written ``LATE`` rows late."""
    rng, rows = np.random.default_rng(seed), round(seconds / PERIOD)
    asked = np.repeat(rng.uniform(-0.5, 0.5, rows // 100 + 1), 100)[:rows]
    angle = speed = 0.0
    angles, currents = np.zeros(rows), np.zeros(rows)
    whole = INERTIA + 0.0002 * RATIO**2
    for k in range(rows):
        angles[k] = angle
        currents[k] = (9.0 * (asked[k] - angle) - 0.8 * speed) / (CONSTANT * RATIO)
        for _ in range(FINE):
            torque = CONSTANT * RATIO * currents[k] - RUBS * np.tanh(speed / 0.005)
            speed += PERIOD / FINE * torque / whole
            angle += PERIOD / FINE * speed
    read = np.concatenate((np.zeros(LATE), currents[:-LATE]))
    return run_of(seed, PERIOD, {
        'motor_position': np.floor(RATIO * angles / COUNT + 0.5) * COUNT, 'voltage': currents,
        'current': read + NOISE * rng.standard_normal(rows)}, 'steps')


@pytest.mark.long
@pytest.mark.slow
def test_it_is_the_reading_that_comes_late_and_nothing_else():
    several = [recorded(seed) for seed in (1, 2, 3)]
    which = diagnose(several[:1], SERVO, several[1:2], several[2:]).report.which
    assert [(one.effect, one.site) for one in which] == [('sensor_delay', 'current')]
    delay = which[0].parameters['delay']['value']  # beyond the instant of a reading in its row
    assert (LATE - 2.0 * SAMPLING) * PERIOD < delay < (LATE + SAMPLING) * PERIOD
