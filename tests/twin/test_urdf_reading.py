"""A joint of a URDF file as a servo: it ..."""

from pathlib import Path
import re

import pytest

mujoco = pytest.importorskip('mujoco')

from servo_twin.simulators.from_model.as_servo import servo_of  # noqa: E402
from servo_twin.simulators.from_model.mujoco_joint import joint_of  # noqa: E402
from servo_twin.simulators.from_model.urdf_model import joint_of_urdf, moving_joints  # noqa: E402
from servo_twin.simulators.joint import ModelError  # noqa: E402
from servo_twin.simulators.mujoco_model import compiled  # noqa: E402

ROBOTS = Path(__file__).resolve().parents[2] / 'config' / 'robots'
ARM = ROBOTS / 'arm.xml'


@pytest.mark.parametrize('elbow', [0.0, 0.7, -2.0])
def test_a_urdf_carries_what_the_same_mjcf_carries(elbow):
    mjcf = joint_of(compiled(ARM)[0], 'shoulder', 'arm.xml', at={'elbow': elbow})
    urdf, _ = joint_of_urdf(ROBOTS / 'arm.urdf', 'shoulder', {'elbow': elbow})
    for field in ('inertia', 'cosine', 'sine', 'damping', 'friction', 'torque_limit'):
        assert getattr(urdf, field) == pytest.approx(getattr(mjcf, field), rel=1e-9), field
    assert urdf.armature == 0.0 and 'no armature' in urdf.sources['armature']
    assert any('speed limit, 6 rad/s' in one for one in urdf.left_out)


def test_a_urdf_says_the_ratio_of_its_transmission():
    joint, reduction = joint_of_urdf(ROBOTS / 'arm.urdf', 'elbow')
    assert (reduction, joint.torque_limit) == (9.0, 13.5)
    assert joint_of_urdf(ROBOTS / 'arm.urdf', 'shoulder')[1] is None


SIMPLE = ('<joint name="elbow" role="joint1"><mechanical_reduction>{}</mechanical_reduction>'
          '</joint>')
COUPLED = '<joint name="elbow"/><joint name="finger"/>'
OFFSET = SIMPLE.format(50).replace('</joint>', '<offset>0.3</offset></joint>')
TWO = ('<joint name="elbow"><mechanicalReduction>2</mechanicalReduction></joint>'
       '<actuator name="m"><mechanicalReduction>50</mechanicalReduction></actuator>')
OF_ROS_1 = '<joint name="elbow"/><actuator name="m"><mechanicalReduction/></actuator>'


def arm_with(folder: Path, transmission: str) -> Path:
    """Return the arm with another transmission of its elbow, as ros2_control has it."""
    text = re.sub('<transmission.*</transmission>', '', (ROBOTS / 'arm.urdf').read_text(),
                  flags=re.DOTALL)
    (folder / 'r.urdf').write_text(text.replace(
        '</robot>', '<ros2_control name="c" type="system"><transmission name="gear">'
        f'{transmission}</transmission></ros2_control></robot>'))
    return folder / 'r.urdf'


@pytest.mark.parametrize(('transmission', 'ratio', 'said'), [
    (SIMPLE.format(50), 50.0, ''), (SIMPLE.format(-50), 50.0, 'turns against the joint'),
    (OFFSET, 50.0, "the offset of transmission 'gear', 0.3"),
    (COUPLED, None, "transmission 'gear', which couples joints ['elbow', 'finger']")])
def test_a_transmission_of_ros2_control_is_read_or_said_to_be_left_out(
        tmp_path, transmission, ratio, said):
    joint, reduction = joint_of_urdf(arm_with(tmp_path, transmission), 'elbow')
    assert reduction == ratio
    assert any(said in one for one in joint.left_out)


@pytest.mark.parametrize('transmission', [SIMPLE.format(0), SIMPLE.format('fifty'), OF_ROS_1])
def test_a_reduction_that_is_no_number_is_refused(tmp_path, transmission):
    with pytest.raises(ModelError, match="'gear' of joint 'elbow' has .* give --ratio"):
        joint_of_urdf(arm_with(tmp_path, transmission), 'elbow')


def test_several_reductions_of_one_joint_are_refused(tmp_path):
    with pytest.raises(ModelError, match="2 of joint 'elbow' in 'gear', 50 of actuator 'm'"):
        joint_of_urdf(arm_with(tmp_path, TWO), 'elbow')


@pytest.mark.parametrize(('number', 'said'), [
    ('damping', 'dynamics damping of -1'), ('friction', 'dynamics friction of -1'),
    ('effort', 'limit effort of -1')])
def test_what_no_joint_has_below_zero_is_refused(tmp_path, number, said):
    text = (ROBOTS / 'arm.urdf').read_text()
    (tmp_path / 'r.urdf').write_text(re.sub(rf' {number}="[^"]*"', f' {number}="-1"', text))
    with pytest.raises(ModelError, match=said):
        joint_of_urdf(tmp_path / 'r.urdf', 'elbow')


def test_a_urdf_is_not_read_as_mjcf_where_its_transmission_would_be_lost():
    with pytest.raises(ModelError, match='is a URDF file; servo-twin from-urdf reads it'):
        compiled(ROBOTS / 'arm.urdf')


def test_a_urdf_joint_may_slide():
    joint, _ = joint_of_urdf(ROBOTS / 'arm.urdf', 'finger')
    assert (joint.slides, joint.inertia) == (True, pytest.approx(0.1))
    assert any('0.04 m' in one for one in joint.left_out)


@pytest.mark.parametrize('pose', [{}, {'a': 0.4, 'b': -1.1}, {'b': 0.2, 's': 0.13}])
def test_a_urdf_is_held_at_a_pose_as_mujoco_moves_there(tmp_path, pose):
    text = """<robot name="r"><link name="w"/>
{links}
<joint name="j" type="continuous"><parent link="w"/><child link="l0"/>
  <origin xyz="0.1 0.2 0.3" rpy="0.2 -0.4 0.9"/><axis xyz="1 2 0.5"/></joint>
<joint name="a" type="revolute"><parent link="l0"/><child link="l1"/>
  <origin xyz="0.2 0 0.1" rpy="1 0.3 -0.2"/><axis xyz="0 1 1"/>
  <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="b" type="continuous"><parent link="l1"/><child link="l2"/><axis xyz="0 0 1"/>
  <origin xyz="0 0.3 0"/></joint>
<joint name="s" type="prismatic"><parent link="l2"/><child link="l3"/><axis xyz="1 1 0"/>
  <origin xyz="0.1 0 0" rpy="0 0 0.7"/><limit lower="0" upper="1" effort="1" velocity="1"/>
  </joint></robot>""".format(links='\n'.join(
        f'<link name="l{i}"><inertial><origin xyz="0.05 0.02 {0.1 * i}" rpy="0.1 0 {0.3 * i}"/>'
        f'<mass value="{1 + i}"/><inertia ixx="0.01" iyy="0.02" izz="0.025" ixy="0.001" ixz="0" '
        f'iyz="0"/></inertial></link>' for i in range(4)))
    (tmp_path / 'r.urdf').write_text(text)
    held, _ = joint_of_urdf(tmp_path / 'r.urdf', 'j', pose)
    whole = joint_of(mujoco.MjModel.from_xml_string(text), 'j', 'r.urdf', at=pose)
    for field in ('inertia', 'cosine', 'sine'):
        assert getattr(held, field) == pytest.approx(getattr(whole, field), rel=1e-9), field


@pytest.mark.parametrize(('effort', 'velocity', 'said'), [
    ('0', '0', 'effort and velocity'), ('0', '2', 'effort'), ('5', '0.0', 'velocity')])
def test_a_limit_of_zero_is_none_and_said_so(tmp_path, effort, velocity, said):
    text = (ROBOTS / 'arm.urdf').read_text()
    limit = re.search(r'<limit[^>]*/>', text)[0]
    zero = re.sub(r'velocity="[^"]*"', f'velocity="{velocity}"',
                  re.sub(r'effort="[^"]*"', f'effort="{effort}"', limit))
    (tmp_path / 'r.urdf').write_text(text.replace(limit, zero))
    name = re.search(r'<joint name="(\w+)"(?:(?!</joint>).)*<limit', text, re.DOTALL)[1]
    joint, _ = joint_of_urdf(tmp_path / 'r.urdf', name)
    assert any(f'a limit of its {said}: 0 in the file' in one for one in joint.left_out)
    assert not any('its speed limit, 0' in one for one in joint.left_out)
    assert not any('0 in the file' in one for one in joint_of_urdf(ROBOTS / 'arm.urdf', name)[
        0].left_out)


def test_links_that_it_does_not_carry_may_be_wrong(tmp_path):
    text = (ROBOTS / 'arm.urdf').read_text()
    bad = text.replace('ixx="0.002" iyy="0.012" izz="0.012"', 'ixx="-1" iyy="0" izz="0"')
    (tmp_path / 'r.urdf').write_text(bad)
    good, _ = joint_of_urdf(ROBOTS / 'arm.urdf', 'elbow')
    assert joint_of_urdf(tmp_path / 'r.urdf', 'elbow')[0].inertia == good.inertia
    with pytest.raises(ModelError, match='upper'):
        joint_of_urdf(tmp_path / 'r.urdf', 'shoulder')


@pytest.mark.parametrize(('change', 'said'), [
    (('<robot name="arm">', '<robot name="arm" xmlns:xacro="x"><xacro:x/>'), 'xacro r.urdf'),
    (('<robot name="arm">', '<roboter>'), 'is not XML'),
    (('<axis xyz="0 1 0"/>', '<axis xyz="0 one 0"/>'), 'no number'),
    (('<mass value="0.1"/>', '<mass value="-1"/>'), "link 'jaw' has a mass of -1 kg"),
    (('<child link="jaw"/>', ''), "joint 'finger' has no parent or no child"),
    (('<?xml version="1.0"?>', '<!DOCTYPE a [<!ENTITY b "c">]>'), 'document type'),
])
def test_a_urdf_that_cannot_be_read_is_refused_with_a_reason(tmp_path, change, said):
    text = (ROBOTS / 'arm.urdf').read_text()
    assert change[0] in text
    (tmp_path / 'r.urdf').write_text(text.replace(*change))
    with pytest.raises(ModelError) as problem:
        joint_of_urdf(tmp_path / 'r.urdf', 'elbow', {'finger': 0.01})
    assert said in str(problem.value)


@pytest.mark.parametrize(('name', 'at', 'said'), [
    ('wrist', {}, "no joint 'wrist'; joints that move are ['shoulder', 'elbow', 'finger']"),
    ('elbow', {'wrist': 1.0}, "no joint 'wrist'")])
def test_a_joint_that_a_urdf_lacks_is_named(name, at, said):
    with pytest.raises(ModelError) as problem:
        joint_of_urdf(ROBOTS / 'arm.urdf', name, at)
    assert said in str(problem.value)


def test_a_urdf_without_masses_makes_no_servo(tmp_path):
    text = (ROBOTS / 'arm.urdf').read_text()
    light = text.replace('<mass value="0.1"/>', '<mass value="0"/>')
    (tmp_path / 'r.urdf').write_text(light)
    with pytest.raises(ModelError):
        servo_of(joint_of_urdf(tmp_path / 'r.urdf', 'finger')[0], 's')


def test_a_joint_that_is_mimicked_says_what_it_does_not_carry(tmp_path):
    text = (ROBOTS / 'arm.urdf').read_text().replace(
        '<parent link="lower"/>', '<parent link="lower"/><mimic joint="elbow"/>')
    (tmp_path / 'r.urdf').write_text(text)
    joint, _ = joint_of_urdf(tmp_path / 'r.urdf', 'elbow')
    assert any("'finger', which mimics it" in one for one in joint.left_out)


def test_a_link_without_mass_between_two_joints_is_no_matter(tmp_path):
    text = (ROBOTS / 'arm.urdf').read_text()
    between = ('<link name="knuckle"/><joint name="roll" type="continuous"><parent '
               'link="knuckle"/><child link="lower"/><axis xyz="1 0 0"/></joint>')
    text = text.replace('<child link="lower"/>', '<child link="knuckle"/>').replace(
        '<link name="base"/>', '<link name="base"/>' + between)
    (tmp_path / 'r.urdf').write_text(text)
    plain, _ = joint_of_urdf(ROBOTS / 'arm.urdf', 'elbow')
    with_it, _ = joint_of_urdf(tmp_path / 'r.urdf', 'elbow')
    assert with_it.inertia == pytest.approx(plain.inertia, rel=1e-9)
    assert with_it.cosine == pytest.approx(plain.cosine, rel=1e-9)


LINK = '<link name="{0}">{1}</link>'
INERTIAL = ('<inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" '
            'izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>')
SHAPE = '<visual><geometry><box size="1 1 1"/></geometry></visual>'
JOINT = ('<joint name="{0}" type="continuous"><parent link="{1}"/><child link="{2}"/>'
         '<axis xyz="0 1 0"/></joint>')


def two_links(folder: Path, first: str, second: str, comment: str = '') -> Path:
    """Return a chain of two joints, its links with what is given."""
    path = folder / 'chain.urdf'
    path.write_text(f'<robot name="r">{comment}<link name="base"/>{LINK.format("a", first)}'
                    f'{LINK.format("b", second)}{JOINT.format("j", "base", "a")}'
                    f'{JOINT.format("k", "a", "b")}</robot>')
    return path


@pytest.mark.parametrize(('second', 'said'), [('', False), (SHAPE, True)])
def test_it_says_which_mass_is_missing(tmp_path, second, said):
    joint, _ = joint_of_urdf(two_links(tmp_path, INERTIAL, second), 'j')
    assert any("the mass of link 'b'" in one for one in joint.left_out) == said
    with pytest.raises(ModelError, match=r"none of the links \['a', 'b'\] has an inertial"):
        joint_of_urdf(two_links(tmp_path, '', second), 'j')


def test_it_knows_what_xacro_left_from_what_a_comment_keeps(tmp_path):
    kept = two_links(tmp_path, INERTIAL, '', '<!-- <xacro:arm prefix="${p}"/> -->')
    assert joint_of_urdf(kept, 'j')[0].inertia == pytest.approx(0.02)
    with pytest.raises(ModelError, match='this is a xacro file'):
        joint_of_urdf(two_links(tmp_path, INERTIAL.replace('"1"', '"${mass}"'), ''), 'j')


@pytest.mark.parametrize('encoding', ['iso-8859-1', 'utf-16', 'utf-8-sig'])
def test_a_urdf_is_read_in_its_own_encoding(tmp_path, encoding):
    declared = f'<?xml version="1.0" encoding="{encoding.removesuffix("-sig")}"?>'
    text = (ROBOTS / 'arm.urdf').read_text().replace('<?xml version="1.0"?>', declared)
    (tmp_path / 'r.urdf').write_text(text.replace('"elbow"', '"Ärmel"'), encoding)
    assert moving_joints(tmp_path / 'r.urdf')[1] == 'Ärmel'
