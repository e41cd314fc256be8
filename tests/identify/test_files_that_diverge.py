"""A twin that cannot run on the report recordings costs its comparison and not the answer."""

import pytest
from test_selection import recorded, SERVO, with_effect

from servo_identify.diagnose import diagnose as diagnosing
from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.handover.simulated_gap import Diverged


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('moved', [True, False], ids=['the new file', 'it without an effect'])
def test_the_answer_stands_where_a_file_diverges(monkeypatch, moved):
    rig = with_effect('gravity', 'load', cosine=0.0, sine=-60.0)
    real, tried = diagnosing.simulated, []

    def simulated(servo, *rest):
        new = servo is not SERVO and any(one.effect.name == 'gravity' for one in servo.effects)
        if servo is not SERVO and new == moved:
            tried.append(servo)
            raise Diverged('beyond the finite numbers')
        return real(servo, *rest)

    monkeypatch.setattr(diagnosing, 'simulated', simulated)
    first, second, third = (recorded(rig, seed) for seed in (1, 2, 3))
    answer = diagnose([first], SERVO, [second], [third])
    assert tried
    assert [one.effect for one in answer.report.which] == ['gravity']
    assert (answer.augmented is SERVO) == moved
    assert any(one.effect.name == 'gravity' for one in answer.refit.effects) != moved
    assert (answer.report.gap['solved'] == 0.0) == moved
