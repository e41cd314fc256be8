"""What is given beside the model of a simulator: it ..."""

import numpy as np
import pytest

mujoco = pytest.importorskip('mujoco')

from mujoco_pendulum import ARM, CARRIED, pendulum, read  # noqa: E402

from servo_twin.description.servo_file import loads  # noqa: E402
from servo_twin.physics.controllers import Impedance, Open  # noqa: E402
from servo_twin.physics.drives import CurrentDrive  # noqa: E402
from servo_twin.simulators.from_model.as_servo import servo_of, text_of  # noqa: E402
from servo_twin.simulators.from_model.mujoco_joint import joint_of  # noqa: E402
from servo_twin.simulators.from_model.required_values import Given  # noqa: E402
from servo_twin.simulators.joint import ModelError  # noqa: E402
from servo_twin.simulators.mujoco_model import compiled  # noqa: E402


def test_what_the_model_does_not_hold_is_said_to_be_so_by_definition():
    servo, _ = servo_of(read('<motor joint="j" gear="9"/>', 'armature="0.1"'), 'servo')
    assert servo.drive is CurrentDrive and servo.controller is Open
    assert servo.values['mechanism.ratio'] == servo.values['drive.torque_constant'] == 1.0
    for path in ('mechanism.ratio', 'drive.torque_constant'):
        assert servo.provenance[path].source.startswith('by definition')
    assert servo.values['drive.gain'] == 9.0
    assert not servo.tolerance and not servo.sensors


def test_flags_put_the_motor_behind_its_gear_without_changing_the_joint():
    model = read('<motor joint="j" gear="9" forcerange="-2 2"/>', 'armature="0.1"')
    plain, _ = servo_of(model, 'plain')
    given = Given(ratio=50.0, torque_constant=0.06, noise={'motor_position': 1e-3, 'current': 0.1},
                  tolerance=0.1)
    geared, _ = servo_of(model, 'geared', given)
    v = geared.values
    torque = v['drive.gain'] * v['drive.torque_constant'] * v['mechanism.ratio']
    assert torque == pytest.approx(9.0)
    assert v['mechanism.rotor_inertia'] * 50.0**2 == pytest.approx(0.1)
    assert v['effects.limit.limit'] == plain.values['effects.limit.limit'] == pytest.approx(2.0)
    assert geared.noise('motor_position') == 1e-3 and np.isnan(geared.noise('torque'))
    low, high = geared.tolerance['mechanism.load_inertia']
    assert (low, high) == pytest.approx((0.9 * CARRIED, 1.1 * CARRIED))
    assert loads(text_of(geared, ['about'], ['something'])) == geared


def test_behind_a_gear_the_rotor_and_the_scale_of_the_joint_are_asked_for():
    bare = '<motor joint="j" gear="9"/>'
    assert not [said for said in servo_of(read(bare), 'direct')[1] if 'rotor' in said]
    _, lacking = servo_of(read(bare), 'geared', Given(ratio=50.0))
    assert any('the inertia of the rotor' in said for said in lacking)
    assert any(said.endswith('its angle is load_position') for said in lacking)
    _, lacking = servo_of(read(''), 'by torque', Given(ratio=50.0, armature=0.1))
    assert not any('rotor' in said for said in lacking)
    assert any(said.endswith('voltage is its torque over 50') for said in lacking)


def test_gains_outside_of_the_model_make_an_impedance_controller():
    servo, _ = servo_of(read('<motor joint="j"/>'), 'servo',
                        Given(kp=20.0, kd=0.5, torque_limit=8.0))
    v = servo.values
    assert servo.controller is Impedance
    assert (v['controller.kp'], v['controller.kd'], v['controller.kf']) == (20.0, 0.5, 1.0)
    assert v['controller.torque_limit'] == 8.0 and v['controller.command_torque'] == 1.0
    assert servo.provenance['controller.kp'].source == 'given: --kp 20'


def test_of_a_winding_two_quotients_are_known_and_the_flags_fix_the_rest():
    joint = read('<general joint="j" gainprm="4" biastype="affine" biasprm="0 0 -0.5"/>')
    for given in (Given(), Given(resistance=2.0), Given(torque_constant=0.1, ratio=20.0),
                  Given(resistance=2.0, torque_constant=0.1, ratio=20.0)):
        v = servo_of(joint, 'servo', given)[0].values
        slope = v['drive.gain'] * v['drive.torque_constant'] / v['drive.resistance']
        lost = v['drive.back_emf'] * v['drive.torque_constant'] / v['drive.resistance']
        assert slope * v['mechanism.ratio'] == pytest.approx(4.0)
        assert lost * v['mechanism.ratio'] ** 2 == pytest.approx(0.5)
        for name in ('resistance', 'torque_constant'):
            if getattr(given, name):
                assert v[f'drive.{name}'] == getattr(given, name)


@pytest.mark.parametrize(('call', 'said'), [
    (lambda: read(chosen=['none']), "actuator 'none' does not act"),
    (lambda: read('<motor name="a" joint="j"/><motor name="b" joint="j"/>'),
     "['a', 'b']; choose by --actuator"),
    (lambda: read('<damper name="a" joint="j" kv="1" ctrlrange="0 1"/>'), 'no affine function'),
    (lambda: read('<muscle name="a" joint="j" ctrlrange="0 1" lengthrange="-1 1"/>'), "'a'"),
    (lambda: read('<general name="a" joint="j" biastype="affine" biasprm="0 3 0"/>'), 'pushes'),
    (lambda: read('<muscle name="m" joint="j" ctrlrange="0 1" lengthrange="-1 1"/>'),
     'take it out of the model'),
    (lambda: read('<muscle name="m" joint="j" ctrlrange="0 1" lengthrange="-1 1"/>'
                  '<motor name="b" joint="j"/>'), "--actuator (['b'])"),
    (lambda: read('<general name="a" joint="j" gainprm="0" biastype="affine" '
                  'biasprm="0 -3 0"/>'), 'does not answer to its control'),
    (lambda: read('<general name="a" joint="j" biastype="affine" biasprm="2 0 0"/>'), 'pushes'),
    (lambda: joint_of(pendulum(), 'none', 'x'), "no joint 'none'; hinges and slides are ['j'"),
    (lambda: joint_of(pendulum(), 'j', 'x', keyframe='home'), "no keyframe 'home'"),
    (lambda: joint_of(pendulum(), 'j', 'x', at={'none': 1.0}), "no joint 'none'"),
    (lambda: read('<dcmotor name="a" joint="j" resistance="1" motorconst="1 1" gear="-2"/>'),
     'gear -2'),
    (lambda: servo_of(read('<position joint="j" kp="3"/>'), 's', Given(kp=1.0)),
     'the model holds kp = 3'),
    (lambda: servo_of(read(joint='armature="1"'), 's', Given(armature=1.0)), 'holds 1 already'),
    (lambda: servo_of(read(), 's', Given(ratio=-1.0)), 'not positive'),
    (lambda: servo_of(read('<motor joint="j"/>'), 's', Given(resistance=1.0)), '--resistance'),
    (lambda: servo_of(read(), 's', Given(noise={'speed': 1.0})), 'no such channel'),
    (lambda: servo_of(read(), 's', Given(tolerance=-0.1)), 'not positive'),
])
def test_what_cannot_be_is_refused_with_a_reason(call, said):
    with pytest.raises(ModelError) as problem:
        call()
    assert said in str(problem.value)


def test_the_motor_of_a_joint_that_slides_turns_where_a_ratio_is_given():
    finger = joint_of(compiled(ARM)[0], 'finger', 'x')
    geared, _ = servo_of(finger, 's', Given(ratio=400.0))
    direct, _ = servo_of(finger, 's')
    assert (geared.unit('mechanism.ratio'), geared.unit('drive.torque_constant')) == (
        'rad/m', 'N m/A')
    assert (direct.unit('mechanism.ratio'), direct.unit('drive.torque_constant')) == ('', 'N/A')
    assert geared.values['mechanism.load_inertia'] == direct.values['mechanism.load_inertia']
