"""A joint of a simulator as a servo: it ..."""

from math import cos, sin

from mujoco_pendulum import ARM, CARRIED, PENDULUM, pendulum, read, TENDON, with_parts
import numpy as np
import pytest

mujoco = pytest.importorskip('mujoco')

from servo_twin.physics.simulate import initial_state, inputs_of, simulate  # noqa: E402
from servo_twin.physics.state import INPUTS  # noqa: E402
from servo_twin.simulators.from_model.as_servo import servo_of  # noqa: E402
from servo_twin.simulators.from_model.mujoco_joint import joint_of  # noqa: E402
from servo_twin.simulators.joint import ModelError  # noqa: E402
from servo_twin.simulators.mujoco_model import compiled, compiled_text  # noqa: E402

# --- masses


def arm_by_hand(elbow):
    """Return inertia (kg m2) and gravity torque at shoulder angle 0 and pi/2 of the arm."""
    lower = np.array([0.3 + 0.1 * cos(elbow) + 0.01 * sin(elbow),
                      -0.1 * sin(elbow) + 0.01 * cos(elbow)])
    jaw = np.array([0.3 + 0.27 * cos(elbow), -0.27 * sin(elbow)])
    parts = ((1.6, np.array([0.14, 0.0]), 0.012), (0.7, lower, 0.004), (0.1, jaw, 3e-5))
    inertia = sum(own + mass * place @ place for mass, place, own in parts)
    # about +y a weight at x, z turns by m g (x cos q + z sin q)
    return inertia, *(9.81 * sum(mass * place[k] for mass, place, _ in parts) for k in (0, 1))


@pytest.mark.parametrize('elbow', [0.0, 0.7, -2.0])
def test_it_carries_what_hangs_on_it_at_the_pose_of_the_rest(elbow):
    model, _ = compiled(ARM)
    joint = joint_of(model, 'shoulder', 'arm.xml', at={'elbow': elbow})
    inertia, cosine, sine = arm_by_hand(elbow)
    assert joint.inertia == pytest.approx(inertia, rel=1e-12)
    assert (joint.cosine, joint.sine) == pytest.approx((cosine, sine), rel=1e-12)
    assert f'elbow = {elbow:g}' in joint.sources['inertia']


def test_its_pose_may_be_a_keyframe():
    model, _ = compiled(ARM)
    home = joint_of(model, 'shoulder', 'arm.xml', keyframe='home')
    assert home.inertia == pytest.approx(arm_by_hand(1.0)[0], rel=1e-12)
    assert "keyframe 'home'" in home.sources['inertia']


def test_it_takes_defaults_and_includes_as_mujoco_does(tmp_path):
    (tmp_path / 'gear.xml').write_text(
        '<mujoco><default><joint armature="0.07"/></default></mujoco>')
    text = PENDULUM.format(step=1e-3, flags='', joint='damping="2"', actuators='')
    (tmp_path / 'robot.xml').write_text(text.replace('<worldbody>',
                                                     '<include file="gear.xml"/><worldbody>', 1))
    model, remarks = compiled(tmp_path / 'robot.xml')
    joint = joint_of(model, 'j', 'robot.xml')
    assert (joint.armature, joint.damping, remarks) == (0.07, 2.0, [])


def test_it_adds_the_armature_of_an_actuator_behind_its_gear():
    joint = read('<motor joint="j" gear="3" armature="0.01"/>', 'armature="0.1"')
    assert joint.armature == pytest.approx(0.19, rel=1e-12)
    assert joint.inertia == pytest.approx(CARRIED, rel=1e-12)


def test_a_slide_carries_masses_and_its_weight_along_the_axis():
    model, _ = compiled(ARM)
    joint = joint_of(model, 'finger', 'arm.xml')
    assert (joint.slides, joint.inertia, joint.cosine) == (True, pytest.approx(0.1), 0.0)
    text = PENDULUM.format(step=1e-3, flags='', joint='type="slide"', actuators='')
    tilted = compiled_text(text.replace('axis="0 1 0" type', 'axis="0 0.6 0.8" type'), 'tilted')
    joint = joint_of(tilted, 'j', 'tilted')
    assert joint.cosine == pytest.approx(-0.8 * 1.5 * 9.81)
    servo, _ = servo_of(joint, 'lift')
    assert servo.linear and servo.unit('effects.gravity.cosine') == 'N'
    data = inputs_of({name: np.full(100, np.nan) for name in INPUTS})
    y = simulate(servo, data, 1e-2, initial_state(servo))
    assert y[-1, 1] == pytest.approx(-0.5 * 0.8 * 9.81 * 0.99**2, rel=1e-3)


def test_what_compensates_gravity_is_taken_off_it():
    text = PENDULUM.format(step=1e-3, flags='', joint='', actuators='')
    half = compiled_text(text.replace('name="arm"', 'name="arm" gravcomp="0.5"'), 'half')
    assert joint_of(half, 'j', 'half').cosine == pytest.approx(0.5 * read().cosine, rel=1e-12)


# --- what moves it


@pytest.mark.parametrize(('actuators', 'expected'), [
    ('<motor joint="j" gear="9"/>', {'gain': 9.0}),
    ('<position joint="j" kp="30" kv="2"/>', {'kp': 30.0, 'kd': 2.0, 'kf': 0.0}),
    ('<position joint="j" kp="30" kv="2" gear="2"/>', {'kp': 120.0, 'kd': 8.0, 'kf': 0.0}),
    ('<velocity joint="j" kv="2" gear="3"/>', {'kd': 18.0, 'kf': 1.0}),
    ('<position joint="j" kp="30" kv="1"/><velocity joint="j" kv="3"/><motor joint="j" gear="5"/>',
     {'kp': 30.0, 'kd': 4.0, 'kf': 0.75, 'gain': 5.0}),
    ('<general joint="j" gainprm="4" biastype="affine" biasprm="0 0 -0.5" gear="2"/>',
     {'gain': 8.0, 'back_emf': 2.0}),
    ('<general joint="j" gainprm="4" dyntype="filterexact" dynprm="0.02"/>',
     {'gain': 4.0, 'lag': 0.02}),
    ('<intvelocity joint="j" kp="7" actrange="-1 1"/>', {'kp': 7.0}),
    ('<motor joint="j" gear="9" ctrlrange="-2 2"/>', {'command_limit': 2.0}),
    ('<motor joint="j" gear="9" forcerange="-2 2"/>', {'torque_limit': 18.0}),
    ('<position joint="j" kp="1" forcerange="-3 3" gear="2"/>', {'torque_limit': 6.0}),
], ids=lambda value: value[:60] if isinstance(value, str) else '')
def test_it_reads_an_actuator_as_mujoco_answers_it(actuators, expected):
    joint = read(actuators)
    for field, value in expected.items():
        assert getattr(joint, field) == pytest.approx(value, rel=1e-12), field
    idle = {'gain', 'back_emf', 'kp', 'kd', 'lag', 'delay'} - set(expected)
    if len(expected) > 1:
        assert all(getattr(joint, field) == 0.0 for field in idle)


@pytest.mark.skipif(not hasattr(mujoco.mjtGain, 'mjGAIN_PID'), reason='MuJoCo has no pid')
@pytest.mark.parametrize(('inputs', 'kf', 'gain'), [
    ('pos vel ff', 1.0, 1.0), ('pos vel', 1.0, 0.0), ('pos', 0.0, 0.0)])
def test_it_reads_the_inputs_of_a_pid(inputs, kf, gain):
    joint = read(f'<pid joint="j" kp="30" kv="2" input="{inputs}"/>')
    assert (joint.kp, joint.kd, joint.kf, joint.gain) == (30.0, 2.0, kf, gain)
    held = read('<pid joint="j" kp="30" kv="2" ki="5" input="pos"/>')
    assert any('integral' in one for one in held.left_out) and held.kp == 30.0


def test_a_limit_of_the_joint_holds_for_all_its_actuators():
    two = '<position name="p" joint="j" kp="5" forcerange="-1 1"/><motor joint="j"/>'
    joint = read(two, 'actuatorfrcrange="-20 20"')
    assert joint.torque_limit == 20.0
    assert any('limits this actuator alone' in one for one in joint.left_out)
    uneven = read('<motor joint="j"/>', 'actuatorfrcrange="-20 10"')
    assert uneven.torque_limit == 20.0
    assert any('both sides' in one for one in uneven.left_out)


def test_a_spring_and_friction_are_those_of_the_joint():
    joint = read(joint='stiffness="3" springref="0.4" damping="0.2" frictionloss="0.5"')
    assert (joint.stiffness, joint.rest) == pytest.approx((3.0, 0.4), rel=1e-12)
    assert (joint.damping, joint.friction) == (0.2, 0.5)
    assert any('softness' in one for one in joint.left_out)


def test_damping_that_bends_is_split_by_powers_of_the_speed():
    try:
        joint = read(joint='damping="0.2 0.05 0.01"')
    except ModelError:
        pytest.skip('this MuJoCo has linear damping only')
    assert joint.damping == pytest.approx(0.2, rel=1e-9)
    said = ' '.join(joint.left_out)
    assert 'square of the speed, 0.05 N m' in said and 'cube of the speed, 0.01 N m' in said


@pytest.mark.parametrize(('flag', 'field'), [
    ('gravity', 'cosine'), ('frictionloss', 'friction'), ('damper', 'damping'),
    ('spring', 'stiffness'), ('actuation', 'gain')])
def test_what_the_model_has_switched_off_is_not_there(flag, field):
    given = {'actuators': '<motor joint="j" gear="2"/>',
             'joint': 'stiffness="3" damping="0.2" frictionloss="0.5"'}
    assert getattr(read(**given), field)
    assert not getattr(read(**given, flags=f'<flag {flag}="disable"/>'), field)


def test_an_actuator_of_a_disabled_group_is_not_there():
    model = pendulum('<motor joint="j" group="2" gear="3"/>')
    model.opt.disableactuator = 1 << 2
    assert joint_of(model, 'j', 'x').gain == 0.0


def test_what_a_tendon_passes_on_is_counted_at_the_joint():
    joint = with_parts(TENDON.format(more='frictionloss="2"'),
                       '<position tendon="t" kp="10" kv="1" gear="2" forcerange="-5 5"/>')
    assert (joint.kp, joint.kd) == pytest.approx((10.0 * 36.0, 36.0))
    assert joint.torque_limit == pytest.approx(5.0 * 2.0 * 3.0)
    assert joint.friction == pytest.approx(2.0 * 3.0)
    assert "tendon 't'" in joint.sources['friction']


@pytest.mark.parametrize('integral', ['', '<config key="ki" value="20"/>'])
def test_a_plugin_is_read_as_it_answers(integral):
    plugin = ('<extension><plugin plugin="mujoco.pid"><instance name="pid">'
              f'<config key="kp" value="40"/>{integral}<config key="kd" value="2"/>'
              '</instance></plugin></extension>')
    dimension = 'actdim="1"' if integral else ''
    joint = with_parts(plugin, '<plugin joint="j" plugin="mujoco.pid" instance="pid" '
                       f'{dimension}/>')
    assert (joint.kp, joint.kd, joint.gain) == pytest.approx((40.0, 2.0, 0.0), rel=2e-3)
    assert any('an integral' in one for one in joint.left_out) == bool(integral)


def test_a_body_that_adheres_is_named_and_drives_nothing():
    joint = read('<adhesion name="grip" body="arm" ctrlrange="0 1" gain="5"/>'
                 '<adhesion name="far" body="other" ctrlrange="0 1" gain="5"/>')
    assert joint.left_out == ("actuator 'grip': the adhesion of body 'arm' to what it touches, no "
                              'torque of the joint',)


def test_a_cylinder_is_a_drive_with_a_lag():
    joint = read('<cylinder name="a" joint="j" timeconst="0.1" area="0.01"/>')
    assert joint.gain == pytest.approx(0.01) and joint.lag == pytest.approx(0.1)
