"""Of a joint of a simulator it says what a servo leaves out, and which file it cannot read."""

import sys

from mujoco_pendulum import ARM, CARRIED, PENDULUM, read, TENDON, with_parts
import pytest

mujoco = pytest.importorskip('mujoco')

from servo_twin.simulators.from_model.mujoco_joint import joint_of  # noqa: E402
from servo_twin.simulators.joint import ModelError  # noqa: E402
from servo_twin.simulators.mujoco_model import compiled, compiled_text  # noqa: E402


def test_it_says_what_a_servo_cannot_hold():
    text = PENDULUM.format(step=1e-3, flags='', joint='range="-1 2"', actuators=(
        '<position name="p" joint="j" kp="5" timeconst="0.1" ctrlrange="-1 1" gear="2"/>'))
    text = text.replace('<actuator>', '<equality><joint joint1="k" joint2="j"/></equality>'
                        '<actuator>', 1)
    said = joint_of(compiled_text(text, 'x'), 'j', 'x').left_out
    for word in ('end stops at -1 and 2 rad', "joint 'k'", 'filter', 'ctrlrange [-1, 1]',
                 'reference_position is 0.5 times'):
        assert any(word in one for one in said), word


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
