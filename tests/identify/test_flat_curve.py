"""A mechanism that its curve does not show: it has a value of its own in the twin, or no law."""

import numpy as np
import pytest

from servo_identify.diagnose.handover.curves import Curve, Part
from servo_identify.diagnose.handover.effect_values import warmed
from servo_identify.diagnose.handover.laws import formed
from servo_identify.diagnose.mechanisms.hypothesis import Columns, Hypothesis, Mechanism
from servo_twin.description.servo_file import load
from servo_twin.description.shipped import servo_at

TIME = np.linspace(0.0, 10.0, 41)
FLAT = Curve('time', 's', 'N m', TIME, *np.zeros((3, 41)), np.ones(41))
DRIFT = Mechanism('friction_drift', 'friction', 'load', ('time', 'temperature'), 'odd')


def test_friction_that_follows_the_temperature_alone_has_its_slope_and_no_decay():
    amplitudes = np.array([0.0, 0.0, 0.0, 0.0, 0.2])  # N m less at the warmest than at the coldest
    found = warmed(Part(0, DRIFT, FLAT, amplitudes), Hypothesis(
        DRIFT, Columns(np.zeros((1, 5))), np.ones(5), detail={'mean': 30.0, 'span': 4.0}), None)
    assert found.effect.name == 'friction_drift' and found.free == ('slope',)
    assert found.values['slope'] == pytest.approx(-0.05)
    assert (found.values['reference'], found.values['excess']) == (30.0, 0.0)


@pytest.mark.parametrize('name', ['friction_drift', 'asymmetric_friction', 'quadratic_drag'])
def test_a_curve_of_nothing_has_no_law(name):
    servo = load(servo_at('rv_bench'))
    part = Part(0, Mechanism(name, 'friction', 'load', ('time',), 'odd'), FLAT, np.zeros(5))
    assert formed(part, servo) is None
