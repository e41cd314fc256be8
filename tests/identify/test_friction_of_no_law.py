"""Friction over speed that no sum of laws is comes as its curve, in one piece."""

from direct_drive import direct_head, shaft, swung
from numba import njit
import numpy as np

from servo_identify.diagnose.diagnose import diagnose
from servo_twin.description import servo_file

CONSTANT, INERTIA, LEVEL, HUMP, AT, WIDE = 0.5, 4.0e-3, 0.06, 0.045, 6.0, 1.6
NOISE = 0.01
SWINGS = (12.0, 0.11), (1.5, 0.43)  # rad, Hz
SERVO = servo_file.loads(direct_head('felt seal', CONSTANT, INERTIA, NOISE) + f"""
effects:
  rubs: {{effect: coulomb_friction, at: motor, level: {LEVEL}}}
  grease: {{effect: viscous_friction, at: motor, slope: 1.0e-3}}
tolerance: {{effects.rubs.level: 15 %, effects.grease.slope: 20 %, mechanism.rotor_inertia: 5 %}}
""")


@njit
def pushes(_, speed):
    """Friction of a seal that chatters about one speed, N m."""
    rubs = LEVEL + HUMP * np.exp(-((abs(speed) - AT) / WIDE)**2)
    return -rubs * np.tanh(speed / 0.01) - 1.0e-3 * speed


def test_a_hump_over_the_speed_is_one_curve_and_no_law():
    several = swung(shaft(pushes, CONSTANT, INERTIA), SWINGS, NOISE, seconds=16.0)
    found = diagnose(several, SERVO).report
    which = found.which
    assert len(which) == 1, found.verdict['sentence']
    one = which[0]
    assert one.rung == 'curve', found.verdict['sentence']
    assert one.mechanism['port'] == 'friction' and one.mechanism['variables'][0] == 'speed'
    x, y = (np.asarray(one.curve[name], float) for name in ('x', 'y'))
    near = np.abs(np.abs(x) - AT) < 1.0
    assert y[near].mean() - y[np.abs(np.abs(x) - 1.5) < 0.7].mean() > 0.6 * HUMP
    assert found.gap['solved'] > 0.8
