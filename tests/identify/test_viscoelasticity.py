"""A transmission that creeps, with a torque sensor and by two encoders alone."""

import pytest
from test_selection import named_by_equations, recorded, SERVO, with_effect, without

from servo_identify.diagnose.diagnose import diagnose

STIFFNESS = SERVO.numbers['mechanism.stiffness']
CREEPS = with_effect('viscoelasticity', 'mesh', stiffness=0.25 * STIFFNESS, time=0.08)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('blind', [(), ('torque',)])
def test_a_transmission_that_creeps_is_no_hysteresis_and_no_other_stiffness(blind):
    several = [without(recorded(CREEPS, seed), *blind) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], SERVO, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['viscoelasticity']
    found = answer.augmented.numbers
    assert found['effects.viscoelasticity.stiffness'] == pytest.approx(0.25 * STIFFNESS, rel=0.15)
    assert found['effects.viscoelasticity.time'] == pytest.approx(0.08, rel=0.15)


@pytest.mark.long
@pytest.mark.slow
def test_another_stiffness_does_not_creep():
    rig = SERVO.with_values({'mechanism.stiffness': 1.3 * STIFFNESS})
    assert named_by_equations([recorded(rig, seed) for seed in (1, 2)]) == {
        ('stiffness_error', 'mesh')}
