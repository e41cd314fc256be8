"""A joint with one encoder and a current, its motion and its torque from formulas of its own."""

import numpy as np
import pytest

from servo_identify.diagnose.handover.added import added_of
from servo_identify.diagnose.handover.hypothesis_effects import parts_of
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.confidence import preferred
from servo_identify.diagnose.selection.explain import explained
from servo_twin.description import servo_file
from servo_twin.recording.recording import Recording

PERIOD = 0.01
INERTIA, SLOPE, CONSTANT = 0.4, 3.3, 10.0
JOINT = """
servo: joint
drive: {{type: current, gain: 1.0, torque_constant: {constant}}}
mechanism: {{type: rigid, rotor_inertia: {inertia}, load_inertia: 0.0, ratio: 1.0}}
sensors: {{motor_encoder: {{noise: 5.0e-5}}, current_sensor: {{noise: 0.02}}}}
effects: {{viscous: {{effect: viscous_friction, at: motor, slope: {slope}}}}}
tolerance: {{mechanism.rotor_inertia: {inertia_within}, effects.viscous.slope: {slope_within}}}
"""


def moved(seed, level=0.0, constant=CONSTANT, stiffness=0.0, saturates=0.0, reach=0.4,
          hangs=lambda angle: 0.0):
    """
    Return a recording of a joint with Coulomb friction of a level, N m.

    Also with a spring of a ``stiffness``, N m/rad, what ``hangs`` at it, N m over the angle, and a
    motor whose torque is its constant times the current over ``1 + saturates |current|``;
    ``reach`` rad is how far it swings.
    """
    time = np.arange(0.0, 30.0, PERIOD)
    angle, speed, acceleration = np.zeros((3, len(time)))
    for k, rate in enumerate(2.0 * np.pi * np.array([0.11, 0.27, 0.53])):
        phase = rate * time + seed + 2.0 * k
        angle += reach / (k + 1) * np.sin(phase)
        speed += reach / (k + 1) * rate * np.cos(phase)
        acceleration -= reach / (k + 1) * rate**2 * np.sin(phase)
    torque = INERTIA * acceleration + SLOPE * speed + level * np.tanh(speed / 1e-3)
    torque += stiffness * angle + hangs(angle)
    asked = torque / constant
    current = asked / (1.0 - saturates * np.abs(asked))
    chance = np.random.default_rng(seed)
    return Recording(f'moved_{seed}', PERIOD, {
        'motor_position': angle + chance.normal(0.0, 5e-5, len(time)),
        'current': current + chance.normal(0.0, 0.02, len(time))}, family='moved')


def found_by(servo, several):
    """Return (name, values) of what the equations say is missing."""
    found = explained(residual_samples(several, servo))
    number, = found.explanation.smallest.choice.numbers
    draws = np.tile(found.amplitudes(number), (2, 1))
    one, = added_of(found, parts_of(found, number, draws, ()))
    return one.part.mechanism.name, one.values


def test_friction_is_no_motor_without_torque():
    # the joint as somebody has it who fitted inertia and viscous friction, and trusts neither
    servo = servo_file.loads(JOINT.format(
        constant=CONSTANT, inertia=0.44, slope=9.6, inertia_within='50 %',
        slope_within=[0.0, 200.0]))
    name, values = found_by(servo, [moved(seed, level=2.4) for seed in (1, 2, 3)])
    assert name == 'coulomb_friction'
    assert list(values.values()) == [pytest.approx(2.4, rel=0.05)]


@pytest.mark.parametrize('share', [0.4, 2.5])
def test_a_torque_constant_is_found_however_far_it_is_off(share):
    servo = servo_file.loads(JOINT.format(constant=CONSTANT, inertia=INERTIA, slope=SLOPE,
                                          inertia_within='2 %', slope_within='2 %'))
    name, values = found_by(servo, [moved(seed, constant=share * CONSTANT) for seed in (1, 2, 3)])
    assert name == 'torque_constant_error'
    assert values == {'drive.torque_constant': pytest.approx(share * CONSTANT, rel=0.05)}


TRUSTED = JOINT.format(constant=CONSTANT, inertia=INERTIA, slope=SLOPE, inertia_within='2 %',
                       slope_within='2 %')


def test_a_spring_over_a_short_travel_may_be_a_weight_and_both_are_told():
    several = [moved(seed, stiffness=40.0, reach=0.15) for seed in (1, 2, 3)]
    found, rivals = preferred(explained(residual_samples(several, servo_file.loads(TRUSTED))))
    (number, (_, others)), = rivals.items()
    named = {found.hypotheses[number].mechanism.name, *(one.mechanism.name for one in others)}
    assert named == {'gravity', 'spring_load'}


def test_a_motor_that_saturates_from_small_currents_on_is_named():
    several = [moved(seed, saturates=0.9, reach=1.0) for seed in (1, 2, 3)]
    assert 2.0 < max(np.abs(one.columns['current']).max() for one in several) < 8.0
    found = explained(residual_samples(several, servo_file.loads(TRUSTED)))
    assert [one.mechanism.name for one in found.chosen] == ['torque_saturation']


def test_a_linkage_that_hangs_at_the_joint_is_no_cogging():
    # half a turn of a joint without a gear: waves of the motor's turn come near to it
    def hangs(angle):
        return 40.0 * np.sin(angle + 0.4) + 8.0 * np.sin(2.0 * angle)

    several = [moved(seed, reach=0.8, hangs=hangs) for seed in (1, 2, 3)]
    found, rivals = preferred(explained(residual_samples(several, servo_file.loads(TRUSTED))))
    (number, (confidence, _)), = rivals.items()
    assert found.hypotheses[number].mechanism.name == 'gravity'
    assert confidence > 0.8


@pytest.mark.parametrize(('weight', 'inertia_within', 'slope_within'), [
    (30.0, '2 %', '2 %'), (8.0, '50 %', [0.0, 200.0])])
def test_a_weight_and_friction_are_no_motor_that_loses_its_torque(weight, inertia_within,
                                                                  slope_within):
    servo = servo_file.loads(JOINT.format(constant=CONSTANT, inertia=INERTIA, slope=SLOPE,
                                          inertia_within=inertia_within,
                                          slope_within=slope_within))
    several = [moved(seed, level=2.4, reach=0.8, hangs=lambda q: weight * np.sin(q))
               for seed in (1, 2, 3)]
    found, rivals = preferred(explained(residual_samples(several, servo)))
    assert {found.hypotheses[number].mechanism.name for number in rivals} == {
        'coulomb_friction', 'gravity'}
