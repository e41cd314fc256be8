"""A torque sensor with an inertia in front of it, and the ratio that it is no other of."""

import pytest
from test_selection import diagnosed, named_by_equations, recorded, SERVO, with_effect, without

from servo_identify.diagnose.residuals.nuisance import untold_ratio
from servo_identify.diagnose.residuals.samples import residual_samples

FLANGE = 0.05 * SERVO.numbers['mechanism.load_inertia']
RATIO = SERVO.numbers['mechanism.ratio']
BEHIND = with_effect('torque_sensor_inertia', 'torque', inertia=FLANGE)


@pytest.mark.long
@pytest.mark.slow
def test_a_reading_that_lacks_what_a_flange_takes_is_the_sensors():
    answer = diagnosed(BEHIND)
    assert [(one.effect, one.site) for one in answer.report.which] == [
        ('torque_sensor_inertia', 'torque')]
    found = answer.augmented.numbers['effects.torque_sensor_inertia.inertia']
    assert found == pytest.approx(FLANGE, rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize('blind', [(), ('load_position',)])
def test_a_file_that_has_the_inertia_in_front_of_its_sensor_lacks_nothing(blind):
    several = [without(recorded(BEHIND, seed), *blind) for seed in (1, 2)]
    assert named_by_equations(several, BEHIND) == set()


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(('share', 'named'), [(0.5, False), (8.0, True)])
def test_another_ratio_is_named_from_what_two_encoders_tell_over_the_travel(share, named):
    told = untold_ratio(residual_samples([recorded(SERVO, 1)], SERVO))
    rig = SERVO.with_values({'mechanism.ratio': RATIO + share * told})
    found = named_by_equations([recorded(rig, seed) for seed in (1, 2)])
    assert (('parameter:ratio', 'mesh') in found) == named
