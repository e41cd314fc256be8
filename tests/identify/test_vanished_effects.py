"""An effect of which a fit by simulation leaves nothing is not told."""

from types import SimpleNamespace

import pytest

from servo_identify.diagnose.handover.added import Added, servo_with
from servo_identify.diagnose.handover.trial import Tried
from servo_identify.diagnose.handover.unwanted import vanished
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

JOINT = servo_file.loads("""
servo: joint
step: 1.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.1}
mechanism: {type: rigid, rotor_inertia: 1.0e-4, load_inertia: 0.03, ratio: 9.0}
""")
DELAY = 'effects.late.delay'
EQUATIONS = 4.0e-4  # s, as the equations have it


@pytest.mark.parametrize('found, without, gone', [
    (4.2e-4, 1.0, None),   # simulation and equations agree
    (2.0e-4, 1.0, None),   # half of it, and twice the deviation that the two leave
    (6.5e-5, 1.0, 0),      # less than the half of what they differ by
    (6.5e-5, 3.0, None),   # unsure, and without it two thirds of the gap are back
    (1.0e-6, 3.0, 0)])
def test_what_equations_and_simulation_differ_by_is_how_sure_a_value_is(found, without, gone):
    late = Added(None, (Placed('late', find('sensor_delay'), 'motor_position'),),
                 {DELAY: EQUATIONS}, (DELAY,))
    there = Added(None, late.placed, {DELAY: found}, (DELAY,))
    fit = SimpleNamespace(servo=servo_with(JOINT, [there]), values={DELAY: found},
                          units={DELAY: 's'}, std_within={DELAY: 1e-5})
    trial = SimpleNamespace(without=lambda whole, number: SimpleNamespace(total=without))
    gap = SimpleNamespace(total=lambda: 1.0)
    assert vanished(Tried(trial, JOINT, (there,), gap, fit), [late]) == gone
