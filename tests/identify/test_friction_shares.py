"""Which law of friction holds most of a curve that none of them is."""

import numpy as np
import pytest

from servo_identify.diagnose.handover.curves import Curve
from servo_identify.diagnose.handover.friction_shares import nearest_over_speed, settled

SPEED = np.linspace(0.0, 8.0, 41)


@pytest.mark.parametrize('density', [np.ones(41), 1.0 / (0.5 + SPEED)],
                         ids=['all speeds alike', 'mostly slow'])
@pytest.mark.parametrize(('y', 'name'), [
    (np.sqrt(SPEED), 'viscous_friction'),
    (np.tanh(SPEED / 0.3) + 0.05 * np.sin(SPEED), 'coulomb_friction'),
    (np.exp(-(SPEED / 0.4) ** 0.55), 'stribeck_friction'),
    (SPEED**2.6, 'quadratic_drag')])
def test_a_curve_over_speed_has_the_name_of_the_law_nearest_to_it(y, name, density):
    band = 0.02 * y.max()
    curve = Curve('speed', 'rad/s', 'N m', SPEED, y, y - band, y + band, density)
    assert nearest_over_speed(curve, ()) == name


@pytest.mark.parametrize(('y', 'level'), [
    (lambda t: 2.0 + 1.5 * np.exp(-t / 1.2), 2.0),   # warms up to what is there for good
    (lambda t: 2.0 - 1.5 * np.exp(-t / 1.2), 2.0),   # builds up to it
    (lambda t: 1.5 * np.exp(-t / 1.2), 0.0),
    (lambda t: 1.5 * np.exp(-t / 40.0), 0.0)])       # slow: a time alone holds it
def test_friction_that_settles_has_the_level_that_it_comes_to(y, level):
    time = np.linspace(0.0, 8.0, 41)
    y = y(time)
    curve = Curve('time', 's', 'N m', time, y, y - 0.02, y + 0.02, np.ones(41))
    assert settled(curve) == pytest.approx(level, abs=0.05)
