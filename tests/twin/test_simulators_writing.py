"""A servo as the joint of a simulator: it ..."""

from math import inf
from pathlib import Path
from xml.etree import ElementTree

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.integrate import solve_ivp

mujoco = pytest.importorskip('mujoco')

from servo_twin.description.servo_file import load, loads  # noqa: E402
from servo_twin.simulators.from_model.as_servo import servo_of  # noqa: E402
from servo_twin.simulators.from_model.mujoco_joint import joint_of  # noqa: E402
from servo_twin.simulators.from_model.required_values import Given  # noqa: E402
from servo_twin.simulators.joint import Joint, ModelError, UNITS  # noqa: E402
from servo_twin.simulators.mujoco_model import compiled_text  # noqa: E402
from servo_twin.simulators.runs.joint_equation import equation_run  # noqa: E402
from servo_twin.simulators.runs.joint_excitation import Excitation, excitation_for  # noqa: E402
from servo_twin.simulators.runs.mujoco_run import mujoco_run  # noqa: E402
from servo_twin.simulators.runs.twin_run import twin_run  # noqa: E402
from servo_twin.simulators.to_model.as_joint import joint_of_servo  # noqa: E402
from servo_twin.simulators.to_model.mjcf import mjcf_text  # noqa: E402
from servo_twin.simulators.to_model.nearest_friction import nearest_friction  # noqa: E402
from servo_twin.simulators.to_model.nearest_joint import compared, nearest_joint, report  # noqa: E402
from servo_twin.simulators.to_model.rigid_link import GRAVITY  # noqa: E402

SERVOS = Path(__file__).resolve().parents[2] / 'config' / 'servos'
STEP = 2e-4  # s, of MuJoCo where the two shall agree
AGREE = 1e-3  # share of the motion's rms by which twin and MuJoCo may differ at that step
CURRENT = 'drive: {type: current, gain: 0.5, torque_constant: 0.1}'
RIGID = 'mechanism: {type: rigid, rotor_inertia: 1.0e-4, load_inertia: 0.05, ratio: 10}'
HELD = """
  dry: {effect: coulomb_friction, at: load, level: 0.3}
  rotor: {effect: coulomb_friction, at: motor, level: 0.01}
  grease: {effect: viscous_friction, at: load, slope: 0.1}
  bearing: {effect: viscous_friction, at: motor, slope: 1.0e-3}
  weight: {effect: gravity, at: load, cosine: 1.0, sine: -2.0}
"""


def servo(*lines, drive=CURRENT, mechanism=RIGID, controller='', effects=HELD, head=''):
    """Return a servo of what a simulator can hold, with some of it changed."""
    return loads('\n'.join(['servo: bench', 'step: 1.0e-4', head, drive, mechanism, controller,
                            'effects:' if effects.strip() else '', effects, *lines]))


LOOP = 'controller: {type: impedance, kp: 40, kd: 1.5, command_torque: 0.5, torque_limit: 20}'
MACHINES = {
    'impedance': servo(controller=LOOP),
    'impedance of a firmware that errs': servo(controller=LOOP.replace('command_torque: 0.5',
                                                                       'command_torque: 0.4')),
    'half of the reference speed': servo(controller=LOOP.replace('kd: 1.5', 'kd: 1.5, kf: 0.5')),
    'stiff limit': servo(controller=LOOP.replace('torque_limit: 20', 'torque_limit: 4')),
    'damper': servo(controller=LOOP.replace('kp: 40', 'kp: 0')),
    'position loop': servo(controller='controller: {type: position_loop, kp: 20.0, kv: 4.0, '
                                      'kf: 1.0, kd: 1.0, limit: 60.0}'),
    'cascade': servo(controller='controller: {type: cascade, kp: 12.0, kv: 6.0, limit: 60.0}'),
    'integral of the speed': servo(controller='controller: {type: velocity_pi, kp: 4.0, ki: 60.0, '
                                              'limit: 60.0}'),
    'torque motor': servo(),
    'torque motor with limit and lag': servo(
        '  most: {effect: drive_saturation, limit: 7.0}',
        '  loop: {effect: current_lag, lag: 0.02}'),
    'spring': servo('  coil: {effect: spring_load, stiffness: 6.0, rest: 0.3}'),
    'winding': servo(drive='drive: {type: voltage, gain: 1.0, resistance: 2.0, inductance: 0.0, '
                           'back_emf: 0.12, torque_constant: 0.1}'),
    'winding in a loop': servo(
        drive='drive: {type: voltage, gain: 1.0, resistance: 2.0, inductance: 0.0, back_emf: 0.1, '
              'torque_constant: 0.1}', controller=LOOP),
    'slide': servo(
        head='travel: linear', controller=LOOP.replace('kp: 40', 'kp: 400').replace(
            'command_torque: 0.5', 'command_torque: 0.05'),
        mechanism='mechanism: {type: rigid, rotor_inertia: 0.1, load_inertia: 2.0, ratio: 1}',
        effects='  weight: {effect: gravity, at: load, cosine: -5.0, order: 0.01}\n'
                '  rail: {effect: coulomb_friction, at: load, level: 1.0}'),
}


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('name', MACHINES)
def test_mujoco_moves_it_as_its_twin_does_where_nothing_is_lost(name):
    machine = MACHINES[name]
    nearest = nearest_joint(machine, 'j', 'mjcf', STEP, duration=4.0)
    assert all('speed asked for' in one.what for one in nearest.lost)
    text = mjcf_text(nearest.joint, STEP, [], '')
    seen = compared(machine, nearest, 'MuJoCo', lambda joint, over: mujoco_run(text, joint, over))
    assert seen.motion > 0.02
    assert seen.rms < AGREE * seen.motion, (seen.rms, seen.motion)


@pytest.mark.parametrize('name', ['impedance', 'torque motor with limit and lag', 'spring',
                                  'winding', 'slide', 'stiff limit'])
def test_the_documented_equation_moves_it_as_its_twin_does(name):
    machine = MACHINES[name]
    nearest = compared(machine, nearest_joint(machine, 'j', 'mjcf', STEP, duration=4.0))
    assert nearest.rms < AGREE * nearest.motion
    assert 'not run' in nearest.by


# --- round trip

FIELDS = [name for name in UNITS if name != 'stiction']
SIZE = st.floats(1e-3, 1e3)
SMALL = st.just(0.0) | st.floats(1e-3, 20.0) | st.floats(-20.0, -1e-3)


@st.composite
def joints(draw):
    """Any joint that an MJCF file can hold."""
    slides = draw(st.booleans())
    given = {name: draw(st.just(0.0) | SIZE) for name in (
        'armature', 'damping', 'friction', 'stiffness', 'gain')}
    given['inertia'] = draw(SIZE)
    if slides:
        share = draw(st.just(0.0) | st.floats(1e-3, 0.9) | st.floats(-0.9, -1e-3))
        given['cosine'] = share * given['inertia'] * GRAVITY
    else:
        given |= {'cosine': draw(SMALL), 'sine': draw(SMALL)}
    if given['stiffness']:
        given['rest'] = draw(st.floats(-3.0, 3.0))
    if draw(st.booleans()):
        given |= {'kp': draw(st.just(0.0) | SIZE), 'kd': draw(SIZE)}
        given['kf'] = draw(st.just(0.0) | st.floats(1e-3, 1.0)) if given['kp'] else 1.0
    elif given['gain']:
        given['back_emf'] = draw(st.just(0.0) | SIZE)
        given['lag'] = draw(st.just(0.0) | st.floats(1e-3, 0.1))
        given['command_limit'] = draw(st.just(inf) | SIZE)
    if given['gain'] or given.get('kd'):
        given['torque_limit'] = draw(st.just(inf) | SIZE)
    return Joint(draw(st.sampled_from(['j', 'knee "left"', 'a--b'])), slides, **given)


@settings(max_examples=80, deadline=None)
@given(joint=joints())
def test_what_is_written_for_mujoco_reads_back_as_the_same_joint(joint):
    text = mjcf_text(joint, 1e-3, ['about -- it'], 'x')
    again = joint_of(compiled_text(text, 'x'), joint.name, 'x')
    for name in FIELDS:
        wanted, found = getattr(joint, name), getattr(again, name)
        if name == 'kf' and not joint.kd:
            continue
        assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12), name
    assert not again.left_out


@pytest.mark.parametrize('name', ['impedance', 'torque motor with limit and lag', 'spring',
                                  'winding', 'slide'])
def test_a_servo_survives_being_written_and_read(name):
    machine = MACHINES[name]
    nearest = nearest_joint(machine, 'j', 'mjcf', 1e-3, duration=0.1)
    text = mjcf_text(nearest.joint, 1e-3, report(nearest), 'x')
    v = machine.values
    given = Given(ratio=v['mechanism.ratio'], torque_constant=v['drive.torque_constant'],
                  resistance=v.get('drive.resistance'))
    again, lacking = servo_of(joint_of(compiled_text(text, 'x'), 'j', 'x'), 'bench', given)
    assert [one for one in lacking if 'counts at the joint' not in one] == []
    same = [path for path in v if path.startswith(('drive.', 'mechanism.', 'controller.k'))]
    assert len(same) >= 5
    for path in [*same, 'drive.gain']:
        assert again.values[path] == pytest.approx(v[path], rel=1e-9), path
    before, after = (joint_of_servo(one, 'j')[0] for one in (machine, again))
    for field in FIELDS:
        assert getattr(after, field) == pytest.approx(getattr(before, field), rel=1e-9), field


def test_end_stops_and_comments_stand_in_the_file():
    text = mjcf_text(joint_of_servo(MACHINES['impedance'], 'j')[0], 1e-3, ['a -- b', '-->'],
                     'run --this', (-1.0, 2.0))
    model = compiled_text(text, 'x')
    assert model.jnt_limited[0] and tuple(model.jnt_range[0]) == (-1.0, 2.0)
    assert ElementTree.fromstring(text).find('custom/text').get('data') == 'run --this'


# --- what is lost

LOSSY = ('  breakaway: {effect: stribeck_friction, at: load, excess: 0.4, fade: 0.1}',
         '  teeth: {effect: load_dependent_friction, at: load, share: 0.15}')


def by_mujoco(machine, nearest, step=STEP):
    """Return a comparison with what MuJoCo makes of the joint."""
    text = mjcf_text(nearest.joint, step, [], '')
    return compared(machine, nearest, 'MuJoCo', lambda joint, over: mujoco_run(text, joint, over))


@pytest.mark.long
def test_the_nearest_friction_is_nearer_than_none():
    machine = servo(*LOSSY, controller=LOOP)
    nearest = nearest_joint(machine, 'j', 'mjcf', STEP, duration=4.0)
    assert [one.what.split(' at')[0] for one in nearest.lost] == [
        'stribeck friction', 'load dependent friction']
    with_it = by_mujoco(machine, nearest)
    plain = nearest_joint(MACHINES['impedance'], 'j', 'mjcf', STEP, duration=4.0)
    without = by_mujoco(machine, plain)
    assert 5 * AGREE * with_it.motion < with_it.rms < 0.6 * without.rms
    assert all(one.moves > 5e-4 for one in nearest.lost)


def test_the_nearest_friction_of_dry_and_viscous_friction_is_itself():
    machine = MACHINES['impedance']
    over = excitation_for(joint_of_servo(machine, 'j')[0], 1e-3, duration=4.0)
    found = nearest_friction(machine, ['dry', 'rotor', 'grease', 'bearing'], over)
    assert found.dry == pytest.approx(0.3 + 10 * 0.01, rel=1e-9)
    assert found.viscous == pytest.approx(0.1 + 100 * 1e-3, rel=1e-9)
    assert found.left < 1e-9 and found.stiction < 1e-6


@pytest.mark.long
def test_the_nearest_friction_is_the_least_squares_of_the_law_over_the_motion():
    machine = servo('  air: {effect: quadratic_drag, at: load, rise: 0.3}', controller=LOOP)
    over = excitation_for(joint_of_servo(machine, 'j')[0], 1e-3, duration=4.0)
    found = nearest_friction(machine, ['air'], over)
    speed = np.gradient(twin_run(machine, over)[:, 1], over.period)
    moving = np.abs(speed) > 1e-3 * np.abs(speed).max()
    rows = np.column_stack([np.sign(speed), speed])[moving]
    drag = (0.3 * speed * np.abs(speed))[moving]
    expected = np.linalg.lstsq(rows, drag, rcond=None)[0]
    assert (found.dry, found.viscous) == pytest.approx(tuple(expected), rel=1e-6)


@pytest.mark.slow
def test_stiction_goes_to_isaac_alone():
    machine = servo(LOSSY[0], controller=LOOP)
    isaac = nearest_joint(machine, 'j', 'isaac', 1e-3, duration=4.0).joint
    assert isaac.friction + isaac.stiction == pytest.approx(0.3 + 10 * 0.01 + 0.4, rel=1e-6)
    assert nearest_joint(machine, 'j', 'mjcf', 1e-3, duration=4.0).joint.stiction == 0.0


@pytest.mark.long
@pytest.mark.slow
def test_it_names_everything_that_a_rigid_joint_has_no_place_for():
    machine = servo(
        '  play: {effect: backlash, at: mesh, width: 0.02}',
        '  teeth: {effect: transmission_error, at: mesh, cosine: [1.0e-3]}',
        '  slots: {effect: cogging, at: motor, cosine: [0.01]}',
        '  late: {effect: command_delay, at: command, delay: 2.0e-3}',
        '  counts: {effect: encoder_counts, at: motor_position, count: 1.0e-4}',
        drive='drive: {type: voltage, gain: 1.0, resistance: 2.0, inductance: 2.0e-3, '
              'back_emf: 0.1, torque_constant: 0.1}',
        mechanism='mechanism: {type: two_inertia, rotor_inertia: 1.0e-4, load_inertia: 0.05, '
                  'ratio: 10, stiffness: 300, damping: 0.2}',
        controller='controller: {type: position_loop, kp: 20.0, kv: 4.0, ki: 2.0, filter: 0.003, '
                   'limit: 60.0}')
    nearest = by_mujoco(machine, nearest_joint(machine, 'j', 'mjcf', 1e-3, duration=4.0), 1e-3)
    said = '\n'.join(report(nearest))
    for word in ('compliance', 'backlash', 'transmission error', 'cogging', 'command delay',
                 'encoder counts', 'inductance', 'integral action', 'filter'):
        assert word in said, word
    moves = {one.what.split(' at ')[0].split(' of ')[0]: one.moves for one in nearest.lost}
    assert moves['backlash'] > 1e-3 and all(np.isfinite(list(moves.values())))
    assert f'{nearest.rms:.3g} rad rms' in said and nearest.by == 'MuJoCo'
    truth = twin_run(machine, nearest.excitation)[:, 1]
    text = mjcf_text(nearest.joint, 1e-3, [], '')
    again = mujoco_run(text, nearest.joint, nearest.excitation) - truth
    assert nearest.rms == pytest.approx(np.sqrt(np.mean(again**2)), rel=1e-12)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('file', sorted(SERVOS.glob('*.yaml')), ids=lambda f: f.stem)
def test_every_shipped_servo_goes_over_or_says_why_not(file):
    machine = load(file)
    if machine.drive.name == 'pmsm_drive':
        with pytest.raises(ModelError, match='loops of its own'):
            nearest_joint(machine, 'j', 'mjcf', 1e-3, duration=0.2)
        return
    nearest = nearest_joint(machine, 'j', 'mjcf', 1e-3, duration=2.0)
    again = joint_of(compiled_text(mjcf_text(nearest.joint, 1e-3, report(nearest), ''), 'x'), 'j',
                     'x')
    for name in FIELDS:
        assert getattr(again, name) == pytest.approx(getattr(nearest.joint, name), rel=1e-9,
                                                     abs=1e-9) or not nearest.joint.kd, name


# --- the equation


def pendulum(**more):
    return Joint('j', inertia=0.04, armature=0.01, cosine=0.5, sine=-1.5, **more)


def test_the_equation_swings_a_pendulum_as_scipy_does():
    joint = pendulum(damping=0.05, stiffness=0.8, rest=0.2, gain=2.0)
    over = Excitation('command', 0.3, 0.8, 3.0, 1e-3, start=0.4)

    def rate(t, x):
        u = np.interp(t, over.time, over.wave())
        torque = (2.0 * u - 0.05 * x[1] - 0.8 * (x[0] - 0.2) + 0.5 * np.cos(x[0])
                  - 1.5 * np.sin(x[0]))
        return [x[1], torque / 0.05]

    expected = solve_ivp(rate, (0.0, 3.0), [0.4, 0.0], t_eval=over.time, rtol=1e-9, atol=1e-9,
                         max_step=1e-2).y[0]
    assert np.abs(equation_run(joint, over) - expected).max() < 2e-3 * np.ptp(expected)


@pytest.mark.parametrize(('stiction', 'moves'), [(0.0, True), (0.6, False)])
def test_the_equation_holds_what_static_friction_can(stiction, moves):
    joint = Joint('j', inertia=0.05, friction=0.5, stiction=stiction, gain=1.0)
    q = equation_run(joint, Excitation('command', 1.0, 1.0, 2.0, 1e-3))
    assert (np.ptp(q) > 0.0) == moves


def test_the_equation_stops_a_joint_for_good():
    joint = Joint('j', inertia=0.05, friction=0.5, kp=10.0, kd=0.2)
    q = equation_run(joint, Excitation('position', 0.3, 0.5, 4.0, 1e-3))
    still = np.flatnonzero(np.diff(q) == 0.0)
    assert len(still) > 100


def test_an_excitation_of_a_command_overcomes_friction_and_weight():
    for joint in (Joint('j', inertia=0.05, friction=0.5, gain=2.0, cosine=1.0),
                  Joint('j', inertia=0.05, gain=0.01), Joint('j', True, inertia=2.0, gain=3.0,
                                                             friction=1.0, stiffness=10.0)):
        over = excitation_for(joint, 1e-3)
        q = equation_run(joint, over)
        assert 0.02 < np.ptp(q) < 20.0
        assert over.wave()[0] == 0.0 and 'two tones' in over.said('rad')
