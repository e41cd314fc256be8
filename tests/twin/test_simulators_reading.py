"""A joint of a simulator as a servo: it ..."""

from math import cos, sin
from pathlib import Path
import sys

import numpy as np
import pytest

mujoco = pytest.importorskip('mujoco')

from servo_twin.physics.drives import VoltageDrive  # noqa: E402
from servo_twin.physics.simulate import initial_state, inputs_of, simulate  # noqa: E402
from servo_twin.physics.state import INPUTS  # noqa: E402
from servo_twin.simulators.from_model.as_servo import servo_of  # noqa: E402
from servo_twin.simulators.from_model.mujoco_joint import joint_of  # noqa: E402
from servo_twin.simulators.joint import ModelError  # noqa: E402
from servo_twin.simulators.mujoco_model import compiled, compiled_text  # noqa: E402

ROBOTS = Path(__file__).resolve().parents[2] / 'config' / 'robots'
ARM = ROBOTS / 'arm.xml'
PENDULUM = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" integrator="Euler" gravity="0 0 -9.81">{flags}</option>
  <worldbody>
    <body name="arm">
      <inertial pos="0.2 0 -0.1" mass="1.5" diaginertia="0.01 0.02 0.03"/>
      <joint name="j" axis="0 1 0" {joint}/>
    </body>
    <body name="other" pos="0 1 0">
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <joint name="k" axis="0 1 0"/>
    </body>
  </worldbody>
  <actuator>{actuators}</actuator>
</mujoco>
"""
CARRIED = 0.02 + 1.5 * (0.2**2 + 0.1**2)  # kg m2 about the axis, by Steiner


def pendulum(actuators='', joint='', flags='', step=1e-3):
    """Return a model with the joint j, its joint attributes and actuators as given."""
    return compiled_text(PENDULUM.format(step=step, flags=flags, joint=joint,
                                         actuators=actuators), 'pendulum.xml')


def read(actuators='', joint='', flags='', chosen=()):
    """Return the joint j of a pendulum."""
    return joint_of(pendulum(actuators, joint, flags), 'j', 'pendulum.xml', actuators=chosen)


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


def test_it_says_what_a_servo_cannot_hold():
    text = PENDULUM.format(step=1e-3, flags='', joint='range="-1 2"', actuators=(
        '<position name="p" joint="j" kp="5" timeconst="0.1" ctrlrange="-1 1" gear="2"/>'))
    text = text.replace('<actuator>', '<equality><joint joint1="k" joint2="j"/></equality>'
                        '<actuator>', 1)
    said = joint_of(compiled_text(text, 'x'), 'j', 'x').left_out
    for word in ('end stops at -1 and 2 rad', "joint 'k'", 'filter', 'ctrlrange [-1, 1]',
                 'reference_position is 0.5 times'):
        assert any(word in one for one in said), word


TENDON = """<tendon><fixed name="t" {more}><joint joint="j" coef="3"/><joint joint="k" coef="0.5"/>
            </fixed></tendon>"""


def with_parts(parts, actuators='', bodies=''):
    """Return the joint j of a pendulum with further parts of a model."""
    text = PENDULUM.format(step=1e-3, flags='', joint='', actuators=actuators)
    text = text.replace('</worldbody>', f'{bodies}</worldbody>').replace(
        '</mujoco>', f'{parts}</mujoco>')
    return joint_of(compiled_text(text, 'x'), 'j', 'x')


def test_what_a_tendon_passes_on_is_counted_at_the_joint():
    joint = with_parts(TENDON.format(more='frictionloss="2"'),
                       '<position tendon="t" kp="10" kv="1" gear="2" forcerange="-5 5"/>')
    assert (joint.kp, joint.kd) == pytest.approx((10.0 * 36.0, 36.0))
    assert joint.torque_limit == pytest.approx(5.0 * 2.0 * 3.0)
    assert joint.friction == pytest.approx(2.0 * 3.0)
    assert "tendon 't'" in joint.sources['friction']


@pytest.mark.parametrize(('parts', 'words'), [
    (TENDON.format(more='limited="true" range="-1 2"'), "range of tendon 't', -1 to 2 m"),
    (TENDON.format(more='actuatorfrcrange="-1 2"'), "actuatorfrcrange [-1, 2] of tendon 't'"),
    (TENDON.format(more='') + '<equality><tendon tendon1="t"/></equality>',
     "equality of tendon 't'"),
    ('<equality><connect body1="arm" body2="other" anchor="0 0 0"/></equality>',
     'equality (connect) number 0, which closes a loop'),
    ('<equality><weld body1="world" body2="arm"/></equality>', 'which closes a loop')])
def test_it_says_what_tendons_and_loops_hold(parts, words):
    assert any(words in one for one in with_parts(parts).left_out)
    off = parts.replace('<connect', '<connect active="false"').replace(
        '<weld', '<weld active="false"')
    assert off == parts or not with_parts(off).left_out


def test_it_says_that_the_state_of_a_filter_is_limited():
    joint = read('<general joint="j" gainprm="4" dyntype="filterexact" dynprm="0.02" '
                 'actlimited="true" actrange="-2 2"/>')
    assert any('actrange [-2, 2]' in one for one in joint.left_out)


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


# --- against MuJoCo


def by_mujoco(model, name, control, start=0.2):
    """Return the positions of j over a control of one actuator, a sample a timestep."""
    data = mujoco.MjData(model)
    place = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
    data.qpos[0] = start
    found = np.empty(len(control))
    for k, value in enumerate(control):
        found[k] = data.qpos[0]
        data.ctrl[place] = value
        mujoco.mj_step(model, data)
    return found


@pytest.mark.long
@pytest.mark.parametrize(('actuators', 'joint', 'column'), [
    ('<motor name="a" joint="j" gear="9" ctrlrange="-1 1"/>',
     'armature="0.05" damping="0.4" stiffness="2" springref="0.3"', 'voltage'),
    ('<position name="a" joint="j" kp="60" kv="3" forcerange="-4 4"/>',
     'armature="0.05" damping="0.4"', 'reference_position'),
    ('<velocity name="a" joint="j" kv="5"/>', 'armature="0.05"', 'reference_velocity'),
    ('<general name="a" joint="j" gainprm="2" biastype="affine" biasprm="0 0 -0.8"/>',
     'armature="0.05"', 'voltage'),
    ('<general name="a" joint="j" gainprm="4" dyntype="filterexact" dynprm="0.05"/>',
     'damping="0.3"', 'voltage'),
])
def test_its_twin_moves_as_mujoco_moves_it(actuators, joint, column):
    step = 1e-4
    model = pendulum(actuators, joint, step=step)
    servo, _ = servo_of(joint_of(model, 'j', 'x'), 'servo')
    t = np.arange(15000) * step
    control = 0.6 * np.sin(5.0 * t) + 0.5 * np.sin(13.0 * t)
    truth = by_mujoco(model, 'a', control)
    columns = {name: np.full(len(t), np.nan) for name in INPUTS} | {column: control}
    mode = 'measured_input' if column == 'voltage' else 'closed_loop'
    y = simulate(servo, inputs_of(columns), step, initial_state(servo, load=0.2), mode)
    assert np.ptp(truth) > 0.05
    assert np.abs(y[:, 1] - truth).max() < 2e-3 * np.ptp(truth)


@pytest.mark.long
@pytest.mark.skipif(not hasattr(mujoco.mjtGain, 'mjGAIN_DCMOTOR'), reason='no dcmotor')
@pytest.mark.parametrize('beside', ['cogging="0.01 6 0.3"', 'lugre="2 0.002 0.02 0.03 4"'])
def test_the_twin_of_a_dcmotor_moves_as_mujoco_moves_it(beside):
    step = 1e-4
    model = pendulum('<dcmotor name="a" joint="j" resistance="2" motorconst="0.05 0.05" gear="20" '
                     f'inductance="0.004 0" armature="1e-4" {beside}/>', 'damping="0.3"',
                     step=step)
    servo, lacking = servo_of(joint_of(model, 'j', 'x'), 'servo')
    assert servo.drive is VoltageDrive and not lacking
    assert servo.values['mechanism.ratio'] == 20.0
    assert servo.values['drive.inductance'] == pytest.approx(0.004)
    t = np.arange(15000) * step
    control = 4.0 * np.sin(5.0 * t) + 6.0 * np.sin(13.0 * t)
    truth = by_mujoco(model, 'a', control, start=0.0)
    columns = {name: np.full(len(t), np.nan) for name in INPUTS} | {'voltage': control}
    y = simulate(servo, inputs_of(columns), step, initial_state(servo))
    assert np.abs(y[:, 1] - truth).max() < 3e-3 * np.ptp(truth)


# --- files


def test_a_missing_mesh_is_no_loss_where_masses_are_given(tmp_path):
    text = PENDULUM.format(step=1e-3, flags='', joint='', actuators='').replace(
        '<worldbody>', '<asset><mesh name="m" file="nowhere.stl"/></asset><worldbody>', 1).replace(
        'axis="0 1 0" />', 'axis="0 1 0"/><geom type="mesh" mesh="m"/>', 1)
    (tmp_path / 'robot.xml').write_text(text)
    model, remarks = compiled(tmp_path / 'robot.xml')
    assert joint_of(model, 'j', 'x').inertia == pytest.approx(CARRIED)
    assert 'nowhere.stl' in remarks[0]
    without = text.replace('<inertial pos="0.2 0 -0.1" mass="1.5" diaginertia="0.01 0.02 0.03"/>',
                           '')
    (tmp_path / 'robot.xml').write_text(without)
    with pytest.raises(ModelError, match="nowhere.stl.*masses of 'arm' follow from their meshes"):
        compiled(tmp_path / 'robot.xml')


def test_a_body_without_a_name_is_told_by_its_parent(tmp_path):
    (tmp_path / 'r.xml').write_text(
        '<mujoco><asset><mesh name="a" file="a.stl"/></asset><worldbody><body name="base"><geom '
        'size="1"/><body><joint name="j"/><geom type="mesh" mesh="a"/></body></body></worldbody>'
        '</mujoco>')
    with pytest.raises(ModelError, match="a body without a name in 'base'"):
        compiled(tmp_path / 'r.xml')



@pytest.mark.parametrize(('text', 'said'), [
    (None, 'there is no such file'), ('<mujoco>', 'cannot read it'),
    ('<mujoco><include file="gone.xml"/></mujoco>', 'gone.xml'),
    ('<mujoco><worldbody><body><joint name="j"/></body></worldbody></mujoco>', 'mass'),
    ('<mujoco><worldbody><body><jiont/></body></worldbody></mujoco>', 'jiont')])
def test_a_file_that_mujoco_refuses_is_refused_by_its_name(tmp_path, text, said):
    path = tmp_path / 'robot.xml'
    if text:
        path.write_text(text)
    with pytest.raises(ModelError) as problem:
        compiled(path)
    assert said in str(problem.value) and 'robot.xml' in str(problem.value)


def test_without_mujoco_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    with pytest.raises(ModelError, match='pip install mujoco'):
        compiled(ARM)
