"""A servo in URDF, in Isaac Lab and as a link: it ..."""

import importlib.util
from math import isinf, pi
import sys
from types import ModuleType
from xml.etree import ElementTree

from hypothesis import given, settings
import numpy as np
import pytest

mujoco = pytest.importorskip('mujoco')

from test_simulators_writing import LOOP, LOSSY, MACHINES, servo, SIZE, SMALL  # noqa: E402

from servo_twin.physics.servo import Servo  # noqa: E402
from servo_twin.simulators.from_model.mujoco_joint import joint_of  # noqa: E402
from servo_twin.simulators.joint import Joint, ModelError  # noqa: E402
from servo_twin.simulators.to_model.as_joint import joint_of_servo  # noqa: E402
from servo_twin.simulators.to_model.isaac import isaac_text  # noqa: E402
from servo_twin.simulators.to_model.nearest_joint import nearest_joint  # noqa: E402
from servo_twin.simulators.to_model.rigid_link import GRAVITY, link_of  # noqa: E402
from servo_twin.simulators.to_model.urdf import urdf_text  # noqa: E402


def test_a_urdf_weighs_and_turns_as_the_joint_with_its_armature():
    joint = nearest_joint(MACHINES['impedance'], 'j', 'urdf', 1e-3, duration=0.5).joint
    text = urdf_text(joint, ['about -- it'], 10.0, (-1.0, 1.0), 6.0)
    again = joint_of(mujoco.MjModel.from_xml_string(text), 'j', 'x')
    assert again.inertia == pytest.approx(joint.inertia + joint.armature, rel=1e-9)
    for field in ('cosine', 'sine', 'damping', 'friction', 'torque_limit'):
        assert getattr(again, field) == pytest.approx(getattr(joint, field), rel=1e-9), field
    tree = ElementTree.fromstring(text)
    assert tree.find('transmission/actuator/mechanicalReduction').text == '10.0'
    assert tree.find('joint/limit').attrib == {'effort': '20.0', 'velocity': '6.0',
                                               'lower': '-1.0', 'upper': '1.0'}


@pytest.mark.parametrize(('machine', 'arguments', 'said'), [
    ('slide', {}, '--range'), ('impedance', {}, '--velocity-limit'),
    ('torque motor', {'span': (0.0, 1.0), 'velocity_limit': 1.0}, '--torque-limit'),
    ('torque motor', {'span': (0.0, 1.0)}, '--velocity-limit')])
def test_a_urdf_asks_for_the_limits_that_it_wants(machine, arguments, said):
    joint = joint_of_servo(MACHINES[machine], 'j')[0]
    with pytest.raises(ModelError, match=said):
        urdf_text(joint, [], **arguments)


class ImplicitActuatorCfg:
    """What Isaac Lab's configuration takes, by name."""

    def __init__(self, *, joint_names_expr, stiffness, damping, armature, friction,
                 dynamic_friction, viscous_friction, effort_limit_sim=None,
                 velocity_limit_sim=None):
        self.__dict__.update({name: value for name, value in locals().items() if name != 'self'})


def executed(text, tmp_path, monkeypatch):
    """Return a written module, imported beside a stand-in for Isaac Lab."""
    lab, actuators = ModuleType('isaaclab'), ModuleType('isaaclab.actuators')
    actuators.ImplicitActuatorCfg = ImplicitActuatorCfg
    monkeypatch.setitem(sys.modules, 'isaaclab', lab)
    monkeypatch.setitem(sys.modules, 'isaaclab.actuators', actuators)
    (tmp_path / 'written.py').write_text(text)
    spec = importlib.util.spec_from_file_location('written', tmp_path / 'written.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.long
def test_isaac_lab_gets_gains_friction_and_limits(tmp_path, monkeypatch):
    joint = nearest_joint(servo(LOSSY[0], controller=LOOP), 'left knee', 'isaac', 1e-3,
                          duration=4.0).joint
    text = isaac_text(joint, ['about """ it', 'C:\\new'], 5.0)
    module = executed(text, tmp_path, monkeypatch)
    cfg = module.LEFT_KNEE
    assert cfg.joint_names_expr == ['left\\ knee']
    assert (cfg.stiffness, cfg.damping) == pytest.approx((40.0, 1.5))
    assert (cfg.armature, cfg.effort_limit_sim, cfg.velocity_limit_sim) == pytest.approx(
        (0.01, 20.0, 5.0))
    assert cfg.friction == pytest.approx(joint.friction + joint.stiction)
    assert cfg.dynamic_friction == joint.friction < cfg.friction
    assert cfg.viscous_friction == joint.damping
    assert module.LEFT_KNEE_EFFORT_PER_COMMAND == pytest.approx(0.5)
    assert f'stiffness = {40.0 * pi / 180.0:.9g}  # N m/deg' in text
    assert f'viscousFrictionCoefficient = {joint.damping * pi / 180.0:.9g}' in text


@pytest.mark.long
def test_a_slide_of_isaac_has_no_degrees(tmp_path, monkeypatch):
    joint = nearest_joint(MACHINES['slide'], '2nd', 'isaac', 1e-3, duration=1.0).joint
    text = isaac_text(joint, [])
    assert executed(text, tmp_path, monkeypatch).ND.stiffness == pytest.approx(400.0)
    assert 'drive:linear:physics:stiffness = 400  # N/m' in text


@pytest.mark.long
@pytest.mark.parametrize('form', ['urdf', 'isaac'])
def test_what_only_mujoco_holds_is_lost_elsewhere(form):
    nearest = nearest_joint(MACHINES['spring'], 'j', form, 1e-3, duration=1.0)
    assert any('spring at the load, 6 N m/rad' in one.what for one in nearest.lost)
    winding = nearest_joint(MACHINES['winding'], 'j', form, 1e-3, duration=1.0).joint
    assert winding.back_emf == 0.0
    assert winding.damping == pytest.approx(0.1 + 0.1 + 100 * 0.12 * 0.1 / 2.0)


@settings(max_examples=60, deadline=None)
@given(inertia=SIZE, cosine=SMALL, sine=SMALL)
def test_a_link_has_the_inertia_and_the_weight_that_it_was_asked_for(inertia, cosine, sine):
    link = link_of(Joint('j', inertia=inertia, cosine=cosine, sine=sine))
    lever = np.hypot(link.place[0], link.place[2])
    assert link.inertia > 0.0 and link.mass > 0.0 and not isinf(link.mass)
    assert link.inertia + link.mass * lever**2 == pytest.approx(inertia, rel=1e-9)
    assert link.mass * GRAVITY * lever == pytest.approx(np.hypot(cosine, sine), abs=1e-9)


@pytest.mark.parametrize('joint', [
    Joint('j', armature=1.0, cosine=2.0), Joint('j', True, inertia=1.0, cosine=20.0)])
def test_a_weight_that_no_link_has_is_refused(joint):
    with pytest.raises(ModelError, match="joint 'j'"):
        link_of(joint)


def test_a_mechanism_that_is_no_joint_is_refused():
    from servo_twin.physics.mechanisms.fmu import Fmu
    machine = MACHINES['torque motor']
    strange = Servo('s', machine.drive, Fmu)
    with pytest.raises(ModelError, match='no joint of a rigid-body simulator'):
        joint_of_servo(strange, 'j')
