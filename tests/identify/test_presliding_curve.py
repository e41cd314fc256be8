"""Friction that builds up over the travel, found as a curve: what is handed over ..."""

from types import SimpleNamespace

import numpy as np
import pytest
from test_shown_factor import AXIS

from servo_identify.diagnose.handover.curves import Part
from servo_identify.diagnose.handover.with_values import with_values
from servo_identify.diagnose.mechanisms.hypothesis import Mechanism
from servo_twin.description.servo_file import dumps, loads

LEVEL, STOP = 0.3, 0.02  # N m, rad


@pytest.mark.parametrize('count', [9, 10, 13])
@pytest.mark.parametrize('rest', [0.0, -0.1])
def test_it_has_the_level_and_the_travel_of_the_curve(count, rest):
    servo = loads(dumps(AXIS))
    knots = np.linspace(0.0, 0.08, count)
    lack = LEVEL * np.maximum(2.0 - knots / STOP, 0.0)
    mechanism = Mechanism('presliding_friction', 'friction', 'load', ('travel since reversal',),
                          'odd')
    one = SimpleNamespace(detail={'form': 'curve'}, knots=tuple(knots))
    (formed,), changes = with_values(Part(0, mechanism, None, lack + rest), one, servo)
    assert formed.values['level'] == pytest.approx(LEVEL)
    assert formed.values['breakaway'] == pytest.approx(STOP, rel=0.1)
    for path, change in changes.items():
        assert change == pytest.approx(max(-LEVEL - rest, -servo.numbers[path]))
