"""The impedance controller, and what is added to the command of any controller: it ..."""

from types import SimpleNamespace

import control
from every_effect import inputs
import numpy as np
import pytest

from servo_twin.bag import read_recording, write_recording
from servo_twin.balances.residual_filters import Balances
from servo_twin.description.servo_file import dumps, loads
from servo_twin.linear.operating_point import usual_point
from servo_twin.linear.sampled_loop import closed_loop, margins
from servo_twin.linear.state_space import linearise
from servo_twin.lockstep.lockstep import Settings
from servo_twin.lockstep.whole_recording import answer
from servo_twin.nodes.message_conversion import to_samples
from servo_twin.physics.controllers import Impedance
from servo_twin.physics.simulate import initial_state, simulate
from servo_twin.physics.state import OUTPUTS
from servo_twin.recording.joined_samples import CHANNELS, Inputs, reference_of
from servo_twin.recording.recording import BALANCES, COLUMNS, Recording

PERIOD = 1e-3
KP, KD, KF, INERTIA, DRAG = 40.0, 1.5, 0.8, 0.06, 0.2
TEXT = """
servo: joint
step: 1.0e-5
drive: {{type: current, gain: 0.5, torque_constant: 0.1}}
mechanism: {{type: rigid, rotor_inertia: 1.0e-4, load_inertia: 0.05, ratio: 10}}
controller: {{type: impedance, kp: {kp}, kd: {kd}, kf: {kf}, command_torque: {command_torque},
              torque_limit: {torque_limit}}}
sensors: {{motor_encoder: {{noise: 1.0e-5}}, voltage_sensor: {{noise: 1.0e-3}}}}
effects:
  drag: {{effect: viscous_friction, at: load, slope: 0.2}}
"""
SET = {'kp': KP, 'kd': KD, 'kf': KF, 'command_torque': 0.5, 'torque_limit': 1.0e+6}


def joint(**changes):
    """Return a joint of 0.06 kg m2 in all, whose true torque is 0.5 N m a volt at the load."""
    return loads(TEXT.format(**SET | changes))


def run(servo, count=2000, **columns):
    """Return what the sensors read of a joint from rest at zero under its own controller."""
    return simulate(servo, inputs(count, **columns), PERIOD, initial_state(servo), 'closed_loop')


def sampled_loop():
    """Return the loop by python-control: from position, speed and torque to the load's angle."""
    z = control.tf([1.0, 0.0], [1.0], PERIOD)
    plant = control.tf(control.c2d(control.ss(
        [[0.0, 1.0], [0.0, -DRAG / INERTIA]], [[0.0], [1.0 / INERTIA]], [[1.0, 0.0]], [[0.0]]),
        PERIOD))
    fed_back = KP + KD * (z - 1.0) / (PERIOD * z)
    torque = control.ss(control.minreal(plant / (1.0 + plant * fed_back), verbose=False))
    return KP * torque, KD * KF * torque, torque


def test_it_answers_as_python_control_says():
    t = np.arange(2000) * PERIOD
    position = 0.3 * np.sin(2.0 * np.pi * t) + np.where(t > 1.0, 0.2, 0.0)
    speed = 0.6 * np.pi * np.cos(2.0 * np.pi * t)
    fed = 0.8 * np.sin(9.0 * t)
    expected = sum(control.forced_response(one, t, u).outputs for one, u in zip(
        sampled_loop(), (position, speed, fed), strict=True))
    y = run(joint(), reference_position=position, reference_velocity=speed,
            added_command=fed / SET['command_torque'])
    assert np.abs(y[:, 1] - expected).max() < 1e-3 * np.ptp(expected)


def test_its_firmware_may_believe_in_another_torque_than_the_motor_has():
    y = run(joint(command_torque=0.4), reference_position=0.2)
    truth = run(joint(kp=KP / 0.8, kd=KD / 0.8), reference_position=0.2)
    assert y[:, 1] == pytest.approx(truth[:, 1], abs=1e-12)


def test_it_needs_no_position_where_it_is_a_damper():
    servo = joint(kp=0.0)
    assert reference_of(servo) == 'reference_velocity'
    assert reference_of(joint()) == 'reference_position'
    y = run(servo, reference_position=np.nan, reference_velocity=1.0)
    held = KD * KF / (KD + DRAG)
    assert y[-1, 1] - y[-1001, 1] == pytest.approx(held, rel=1e-6)


@pytest.mark.parametrize('fed', [0.0, 50.0, -50.0])
def test_its_limit_is_that_of_the_whole_torque(fed):
    y = run(joint(torque_limit=3.0), 5, reference_position=1.0, added_command=fed)
    wanted = np.clip(KP + 0.5 * fed, -3.0, 3.0) / 0.5
    assert y[0, 4] == pytest.approx(wanted)


@pytest.mark.long
@pytest.mark.parametrize('kind', [
    'velocity_pi, kp: 2.0, ki: 0.0, limit: 1.5', 'position_loop, kp: 3.0, kv: 2.0, limit: 1.5',
    'cascade, kp: 3.0, kv: 2.0, limit: 1.5',
    'impedance, kp: 6.0, kd: 2.0, command_torque: 1.0, torque_limit: 1.5'])
def test_what_is_added_stands_behind_every_controller_and_before_its_limit(kind):
    before, after = TEXT.split('controller:')
    rest = after.split('sensors:')[1]
    servo = loads((before + 'controller: {{type: ' + kind + '}}\nsensors:' + rest).format())

    def first(added):
        return run(servo, 2, reference_position=0.1, reference_velocity=0.1,
                   added_command=added)[0, 4]

    assert first(0.25) == pytest.approx(first(0.0) + 0.25)
    assert first(9.0) == 1.5 and first(-9.0) == -1.5
    assert first(np.nan) == first(0.0)


def test_an_integral_stands_still_while_the_sum_is_at_the_limit():
    loop = 'velocity_pi, kp: 0.0, ki: 10.0, limit: 1.0'
    before, after = TEXT.split('controller:')
    text = before + 'controller: {{type: ' + loop + '}}\nsensors:' + after.split('sensors:')[1]
    y = run(loads(text.format()), 200, reference_velocity=1.0,
            added_command=np.where(np.arange(200) < 100, 5.0, 0.0))
    assert (y[:100, 4] == 1.0).all()
    assert y[100, 4] < 0.1


def test_it_has_a_linear_form_with_the_stiffness_and_damping_that_it_was_set_to():
    servo = joint()
    point = usual_point(servo)
    form = closed_loop(servo, 'reference_position', ('load_position',), point, PERIOD)
    frequency = np.geomspace(0.3, 60.0, 40)
    z = np.exp(2j * np.pi * frequency * PERIOD)
    wanted = sampled_loop()[0]
    assert form.response('load_position', frequency) == pytest.approx(wanted(z), rel=1e-4)
    assert np.isfinite(margins(form)['phase margin, deg'])
    plain = linearise(servo, 'voltage', ('load_position',), point)
    assert len(plain.system.A) == 2


def test_it_survives_its_servo_file():
    servo = joint()
    assert loads(dumps(servo)) == servo and servo.controller is Impedance
    assert servo.unit('controller.command_torque') == 'N m/V'


def recording(servo, count=3000, **columns):
    """Return what a rig records that is this joint, its torque fed forward included."""
    columns = {name: np.broadcast_to(one, count).astype(float) for name, one in columns.items()}
    y = run(servo, count, **columns)
    measured = dict(zip(OUTPUTS, y.T, strict=True))
    del measured['load_position'], measured['torque'], measured['current']
    return Recording('rig', PERIOD, {**measured, **columns})


def moved(added):
    """Return a recording in which the joint swings while a torque is added to its command."""
    t = np.arange(3000) * PERIOD
    return recording(joint(), reference_position=0.3 * np.sin(4.0 * t),
                     reference_velocity=1.2 * np.cos(4.0 * t), added_command=added)


def test_the_twin_in_closed_loop_adds_what_the_rig_added():
    fed = 0.6 * np.sin(7.0 * np.arange(3000) * PERIOD)
    seen = moved(fed)
    said = answer(seen, joint(), Settings(mode='closed_loop', catch=0.0))
    assert said.prediction['voltage'] == pytest.approx(seen['voltage'], abs=1e-9)
    without = Recording('rig', PERIOD, {**seen.columns, 'added_command': np.full(3000, np.nan)})
    said = answer(without, joint(), Settings(mode='closed_loop', catch=0.0))
    assert np.abs(said.prediction['motor_position'] - seen['motor_position']).max() > 0.05


def test_the_controller_balance_knows_what_was_added():
    fed = 0.6 * np.sin(7.0 * np.arange(3000) * PERIOD)
    seen = moved(fed)
    row = BALANCES.index('controller')

    def worst(columns):
        samples = np.column_stack([columns[name] for name in CHANNELS])
        found = Balances(joint(), PERIOD).whole(samples, np.zeros((3000, len(OUTPUTS))))
        return np.nanmax(np.abs(found[:, row]))

    assert worst(seen.columns) < 1e-3
    assert worst({**seen.columns, 'added_command': np.zeros(3000)}) > 1.0


def test_the_loop_closes_without_a_bump_beside_what_is_added():
    loop = 'velocity_pi, kp: 0.1, ki: 10.0, limit: 9.0'
    before, after = TEXT.split('controller:')
    servo = loads((before + 'controller: {{type: ' + loop + '}}\nsensors:'
                   + after.split('sensors:')[1]).format())
    count = 400
    columns = {name: np.full(count, np.nan) for name in COLUMNS}
    columns |= {'voltage': np.full(count, 0.7), 'added_command': np.full(count, 0.5),
                'motor_position': np.zeros(count),
                'reference_velocity': np.where(np.arange(count) < 200, np.nan, 0.0)}
    said = answer(Recording('r', PERIOD, columns), servo, Settings(mode='closed_loop', catch=0.0))
    assert said.prediction['voltage'][199] == 0.7
    # the integral's own steps of 9 mV; with a speed of zero the second one had been of 94 mV
    assert np.abs(np.diff(said.prediction['voltage'][199:210])).max() < 0.01


def test_it_adds_nothing_where_the_column_is_missing_in_parts():
    samples = np.full((4, len(CHANNELS)), np.nan)
    samples[:, CHANNELS.index('added_command')] = [1.0, np.nan, 2.0, np.nan]
    u, _ = Inputs().take(samples, None)
    assert u[:, -1].tolist() == [1.0, 0.0, 2.0, 0.0]


@pytest.mark.parametrize('added', [np.nan, np.linspace(-1.0, 1.0, 3000)])
def test_a_bag_keeps_what_was_added_and_says_nothing_where_nothing_was(tmp_path, added):
    seen = moved(0.0)
    seen = Recording('rig', PERIOD, {**seen.columns,
                                     'added_command': np.broadcast_to(added, 3000).copy()})
    write_recording(tmp_path / 'b', seen)
    again = read_recording(tmp_path / 'b')
    assert np.array_equal(again['added_command'], seen['added_command'], equal_nan=True)
    assert np.array_equal(again['voltage'], seen['voltage'])
    assert again.has('added_command') == bool(np.isfinite(added).any())


def test_a_message_may_leave_it_out():
    lists = {'encoder': ('motor_position', 'load_position'),
             'torque': ('torque', 'external_torque'),
             'current': ('current', 'voltage', 'current_reference', 'reference_velocity',
                         'reference_position', 'temperature')}
    header = SimpleNamespace(stamp=SimpleNamespace(sec=0))
    parts = {topic: SimpleNamespace(sequence=0, period=1e-3, header=header,
                                    **{name: [1.0, 2.0] for name in names})
             for topic, names in lists.items()}
    parts['current'].added_command = []
    column = to_samples(parts)[:, CHANNELS.index('added_command')]
    assert np.isnan(column).all()
    parts['current'].added_command = [0.5, 0.6]
    assert to_samples(parts)[:, CHANNELS.index('added_command')].tolist() == [0.5, 0.6]
    parts['current'].added_command = [0.5]
    with pytest.raises(ValueError, match='added_command'):
        to_samples(parts)
