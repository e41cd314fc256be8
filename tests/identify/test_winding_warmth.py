"""A winding that warms up during each run: its resistance over the time."""


import numpy as np
import pytest
from test_one_motor import HOBBY, moved

from servo_identify.diagnose.diagnose import diagnose
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed


def warming(servo, **values):
    paths = {f'effects.warm.{name}': value for name, value in (values | {
        'resistance': servo.numbers['drive.resistance'],
        'back_emf': servo.numbers['drive.back_emf']}).items()}
    return servo.with_effects(Placed('warm', find('winding_warmth'), 'command'), values=paths)


def test_it_takes_the_volts_of_the_ohms_that_it_has_gained():
    law, p = find('winding_warmth').law, find('winding_warmth')
    told = {name: one.default for name, one in p.parameters.items()} | {
        'rise': 0.8, 'settling': 20.0, 'resistance': 3.2, 'back_emf': 0.3, 'gain': 2.0}
    values = type('Values', (), told)
    for time, ohms in ((0.0, 3.2), (20.0, 3.2 + 0.8 * (1.0 - np.exp(-1.0))), (1e4, 4.0)):
        command = law(values, np.zeros(1), p.motion(6.0, 5.0, time), 1e-3)
        assert (2.0 * command - 0.3 * 5.0) / 3.2 == pytest.approx((2.0 * 6.0 - 0.3 * 5.0) / ohms)


@pytest.mark.long
@pytest.mark.slow
def test_it_is_another_resistance_and_is_handed_over_with_its_rise():
    rig = warming(HOBBY, rise=1.2, settling=8.0)
    several = [moved(rig, seed, row=1e-3, size=4.0) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], HOBBY, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['parameter:resistance']
    assert answer.report.gap['solved'] > 0.8
    numbers = answer.augmented.numbers
    cold, rise, settling = (numbers[path] for path in (
        'drive.resistance', 'effects.winding_warmth.rise', 'effects.winding_warmth.settling'))
    at_end = cold + rise * (1.0 - np.exp(-15.0 / settling))
    assert cold == pytest.approx(3.2, rel=0.03)
    assert at_end == pytest.approx(3.2 + 1.2 * (1.0 - np.exp(-15.0 / 8.0)), rel=0.03)
