"""Each number of a row may be off within a tolerance of its own, as of a wave over an angle."""

from direct_drive import direct_head, shaft, swung
from numba import njit
import numpy as np
import pytest

from servo_identify.diagnose.answer.patch import patched
from servo_identify.diagnose.diagnose import diagnose
from servo_identify.fit.free_values import freedom_of, tolerated
from servo_twin.description import servo_file
from servo_twin.lockstep.live_changes import changed
from servo_twin.physics.servo import ServoError

CONSTANT, INERTIA, RUBS, COGS = 0.5, 4.0e-3, 0.06, 0.08
NOISE = 0.02
TEXT = direct_head('table', CONSTANT, INERTIA, NOISE) + f"""
effects:
  rubs: {{effect: coulomb_friction, at: motor, level: {RUBS}}}
  teeth: {{effect: cogging, at: motor, order: 7, cosine: [{COGS}], sine: [0.0]}}
"""
SHARE = TEXT + 'tolerance: {effects.teeth.cosine: 20 %}\n'


def recorded(cogs):
    """Return swings of a direct drive that cogs seven times a turn."""
    @njit
    def pushes(angle, speed):
        return cogs * np.cos(7.0 * angle) - RUBS * np.tanh(speed / 0.01)

    return swung(shaft(pushes, CONSTANT, INERTIA), ((3.0, 0.09), (0.4, 0.43)), NOISE)


def test_a_share_of_a_row_is_that_of_each_number_that_is_not_zero():
    servo = servo_file.loads(SHARE)
    assert servo.tolerance == {'effects.teeth.cosine[0]': pytest.approx((0.064, 0.096))}
    again = servo_file.loads(servo_file.dumps(servo))
    assert again.tolerance == servo.tolerance
    one = servo_file.loads(TEXT + 'tolerance:\n  effects.teeth.sine[0]: [-0.01, 0.02]\n')
    assert one.tolerance == {'effects.teeth.sine[0]': (-0.01, 0.02)}


def test_a_number_of_a_row_is_read_and_changed_by_its_place():
    servo = servo_file.loads(SHARE)
    assert servo.number('effects.teeth.cosine[0]') == COGS
    other = servo.with_values({'effects.teeth.cosine[0]': 0.07})
    assert other.values['effects.teeth.cosine'] == (0.07,)
    with pytest.raises(ServoError, match=r'a row of 1'):
        servo.number('effects.teeth.cosine')


def test_a_row_that_leaves_its_tolerance_while_a_twin_runs_has_none_any_more():
    servo = servo_file.loads(SHARE)
    assert changed(servo, {'effects.teeth.cosine': (0.09,)}).tolerance == servo.tolerance
    assert not changed(servo, {'effects.teeth.cosine': (0.2,)}).tolerance


def test_a_fit_keeps_each_number_of_a_row_within_its_own_tolerance():
    servo = servo_file.loads(SHARE)
    free = freedom_of(servo, ['effects.teeth.cosine', 'effects.teeth.sine'], None)
    assert free.names == ('effects.teeth.cosine[0]', 'effects.teeth.sine[0]')
    assert (free.low[0], free.high[0]) == pytest.approx((0.064, 0.096))
    assert free.low[1] < -1.0 < 1.0 < free.high[1], 'the sine has no tolerance'
    assert tolerated(servo, free)[0] > tolerated(servo, free)[1] == 0.0


def test_what_a_row_is_off_within_its_tolerance_is_no_gap():
    several = recorded(1.12 * COGS)
    answer = diagnose(several, servo_file.loads(SHARE)).report
    assert answer.verdict['status'] == 'no_gap', answer.verdict['sentence']
    exact = diagnose(several, servo_file.loads(TEXT)).report
    assert exact.which[0].effect == 'cogging'


def test_what_a_row_is_off_beyond_its_tolerance_is_named_beside_it():
    found = diagnose(recorded(1.8 * COGS), servo_file.loads(SHARE))
    assert found.report.which[0].effect == 'cogging', found.report.verdict['sentence']
    twin = found.augmented
    waves = [twin.values[f'effects.{one.name}.cosine'][0] for one in twin.effects
             if one.effect.name == 'cogging']
    assert sum(waves) == pytest.approx(1.8 * COGS, rel=0.05)
    text = patched(SHARE, servo_file.loads(SHARE), twin)
    assert servo_file.loads(text).theta == pytest.approx(twin.theta, rel=1e-4)
