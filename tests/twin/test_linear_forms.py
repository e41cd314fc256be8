"""Linear forms: against closed forms, against the simulation, and beside what was recorded."""

from dataclasses import replace
import json
from pathlib import Path

import control
import numpy as np
import pytest

from servo_identify.data.table_import import import_table
from servo_twin.cli import main
from servo_twin.description import servo_file
from servo_twin.linear.frequency_response import estimate, extremes
from servo_twin.linear.operating_point import Still, usual_point
from servo_twin.linear.sampled_loop import closed_loop, margins
from servo_twin.linear.state_space import linearise
from servo_twin.physics.catalogue import find
from servo_twin.physics.controllers import VelocityPi
from servo_twin.physics.drives import CurrentDrive, VoltageDrive
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.servo import Placed, Servo, ServoError
from servo_twin.physics.simulate import inputs_of, simulate
from servo_twin.physics.state import INPUTS
from servo_twin.recording.recording import Recording

CONFIG = Path(__file__).resolve().parents[2] / 'config'
PERIOD = 1e-3
MASSES = {'drive.gain': 1.5, 'drive.resistance': 2.0, 'drive.inductance': 4e-3,
          'drive.back_emf': 0.05, 'drive.torque_constant': 0.06, 'mechanism.ratio': 10.0,
          'mechanism.rotor_inertia': 1e-4, 'mechanism.load_inertia': 0.02,
          'mechanism.stiffness': 300.0, 'mechanism.damping': 0.08}
EFFECTS = (('rotor', 'viscous_friction', 'motor'), ('drag', 'viscous_friction', 'load'),
           ('load', 'stribeck_friction', 'load'), ('dry', 'coulomb_friction', 'load'),
           ('play', 'backlash', 'mesh'), ('late', 'command_delay', 'command'),
           ('old', 'sensor_delay', 'load_position'))
PLAIN = {'effects.rotor.slope': 2e-4, 'effects.dry.level': 0.0, 'effects.load.excess': 0.0,
         'effects.drag.slope': 0.03, 'effects.load.fade': 0.5, 'effects.play.width': 0.01,
         'effects.late.delay': 0.0, 'effects.old.delay': 0.0}


def machine(step=1e-5, **values):
    """Return two masses behind a winding, with friction, play and delays, all of one structure."""
    given = {path.replace('__', '.'): value for path, value in values.items()}
    known = {p: v for p, v in PLAIN.items()}
    slips = {'controller.kp': 0.3, 'controller.ki': 3.0, 'controller.limit': 100.0}
    return Servo('masses', VoltageDrive, TwoInertia, VelocityPi, (),
                 tuple(Placed(n, find(e), s) for n, e, s in EFFECTS),
                 {**MASSES, **known, **slips, **given}, step=step)


def winding_and_two_masses(s):
    """Return motor speed and load speed over voltage, from the equations by hand."""
    v = {path.partition('.')[2]: value for path, value in MASSES.items()}
    spring = v['stiffness'] / s + v['damping']
    load = v['load_inertia'] * s + 0.03
    felt = 1.0 / (1.0 / spring + 1.0 / load) / v['ratio']**2
    motor = v['rotor_inertia'] * s + 2e-4 + felt
    winding = v['inductance'] * s + v['resistance']
    speed = v['gain'] * v['torque_constant'] / (winding * motor
                                                + v['torque_constant'] * v['back_emf'])
    return speed, speed / v['ratio'] * spring / (spring + load)


@pytest.mark.long
def test_it_gives_the_closed_form_of_two_masses_behind_a_winding():
    form = linearise(machine(), 'voltage', ('motor_speed', 'load_speed'), usual_point(machine()))
    frequency = np.geomspace(0.05, 2000.0, 60)
    s = 2j * np.pi * frequency
    for name, expected in zip(form.outputs, winding_and_two_masses(s), strict=True):
        assert np.abs(form.response(name, frequency) / expected - 1.0).max() < 1e-5
        assert np.abs(form.transfer(name)(s) / expected - 1.0).max() < 1e-5
    assert form.system.state_labels == ['wind_up', 'motor_speed', 'load_speed', 'current']
    assert form.left_out == {'play': 'the teeth are taken to touch; within the gap there is no '
                                     'torque'}


def test_its_antiresonance_is_that_of_the_load_on_its_spring_and_its_angles_integrate():
    form = linearise(machine(mechanism__damping=0.0, effects__drag__slope=0.0), 'current',
                     ('motor_position', 'motor_speed'), usual_point(machine()))
    (low,) = [z for z in form.zeros('motor_position') if z.resonant]
    (top,) = [p for p in form.poles('motor_position') if p.resonant]
    assert low.frequency == pytest.approx(np.sqrt(300.0 / 0.02) / (2 * np.pi), rel=1e-6)
    assert top.frequency == pytest.approx(np.sqrt(300.0 / 0.02 + 300.0 / 1e-2) / (2 * np.pi),
                                          rel=1e-4)
    f = np.array([3.0, 30.0])
    integral = form.response('motor_speed', f) / (2j * np.pi * f)
    assert form.response('motor_position', f) == pytest.approx(integral, rel=1e-9)


@pytest.mark.parametrize('speed', [0.4, -3.0])
def test_small_changes_of_a_simulation_go_as_the_linear_form_says(speed):
    servo = machine(effects__load__excess=0.4, effects__dry__level=0.2)
    point = usual_point(servo, speed=speed)
    still = Still(servo, point)
    count = 120
    columns = {name: np.full(count, np.nan) for name in INPUTS}
    columns['external_torque'] = np.zeros(count)
    small = 2e-3 * np.sin(2 * np.pi * 25.0 * np.arange(count) * PERIOD)
    angles = []
    for change in (0.0, 1.0):
        columns['voltage'] = still.command + change * small
        angles.append(simulate(servo, inputs_of(columns), PERIOD, still.x.copy(), on=still.on))
    form = linearise(servo, 'voltage', ('motor_position',), point)
    system = control.sample_system(form.one('motor_position'), PERIOD, 'zoh')
    expected = control.forced_response(system, np.arange(count) * PERIOD, small).outputs
    found = (angles[1] - angles[0])[:, 0]
    assert np.abs(found - expected).max() < 3e-3 * np.ptp(expected)


def test_friction_that_falls_with_speed_gives_an_unstable_pole_and_none_gives_an_integrator():
    servo = machine(effects__load__excess=2.0, effects__drag__slope=0.0, drive__back_emf=0.0,
                    effects__rotor__slope=0.0)
    sliding = linearise(servo, 'voltage', ('load_speed',), usual_point(servo, speed=0.3))
    assert max(p.place.real for p in sliding.poles('load_speed')) > 1.0
    free = linearise(servo, 'voltage', ('load_speed',), usual_point(servo, 'none'))
    assert max(p.place.real for p in free.poles('load_speed')) == pytest.approx(0.0, abs=1e-4)
    assert free.left_out['load'] == 'friction is none'


def test_a_load_that_sticks_leaves_the_motor_on_the_mesh():
    servo = machine(mechanism__damping=0.0)
    form = linearise(servo, 'current', ('motor_position',), usual_point(servo, 'stuck'))
    (pole,) = [p for p in form.poles('motor_position') if p.place.imag > 0.0]
    assert pole.frequency == pytest.approx(np.sqrt(300.0 / 100.0 / 1e-4) / (2 * np.pi), rel=1e-6)
    assert len(form.system.A) == 2


@pytest.mark.parametrize('delays', [(0.0, 0.0), (2.3e-3, 1.4e-3)])
def test_a_closed_loop_answers_as_the_simulation_does(delays):
    servo = machine(effects__play__width=0.0, effects__late__delay=delays[0],
                    effects__old__delay=delays[1], controller__on_load=1.0)
    form = closed_loop(servo, 'reference_velocity', ('load_position', 'current'),
                       usual_point(servo), PERIOD)
    count = 600
    columns = {name: np.full(count, np.nan) for name in INPUTS}
    columns['reference_velocity'] = np.where(np.arange(count) < 20, 0.0, 0.5)
    still = Still(servo, usual_point(servo, 'none'))
    y = simulate(servo, inputs_of(columns), PERIOD, still.x.copy(), 'closed_loop')
    t = np.arange(count) * PERIOD
    for name, column in (('load_position', 1), ('current', 3)):
        answer = control.forced_response(form.one(name), t, columns['reference_velocity']).outputs
        assert np.abs(y[:, column] - answer).max() < 4e-3 * np.ptp(answer)


def test_margins_are_those_of_the_loop_by_hand():
    form, prompt = (
        closed_loop(servo, 'reference_velocity', ('load_speed',), usual_point(servo), PERIOD)
        for servo in (machine(effects__late__delay=2e-3), machine()))
    found = margins(form)
    z = np.exp(2j * np.pi * found['crossover, Hz'] * PERIOD)
    loop = form.loop(z)
    assert abs(loop) == pytest.approx(1.0, rel=1e-3)
    assert found['phase margin, deg'] == pytest.approx(np.degrees(np.angle(-loop)), abs=0.1)
    lost = margins(prompt)['phase margin, deg'] - found['phase margin, deg']
    assert lost == pytest.approx(360.0 * found['crossover, Hz'] * 2e-3, abs=0.5)


@pytest.mark.long
@pytest.mark.parametrize('file', sorted((CONFIG / 'servos').glob('*.yaml')), ids=lambda f: f.stem)
def test_every_shipped_servo_has_a_linear_form(file):
    servo = servo_file.load(file)
    form = linearise(servo, 'current', ('motor_speed', 'load_speed'), usual_point(servo))
    answer = form.response('motor_speed', np.array([0.5, 5.0]))
    assert np.isfinite(answer).all() and (np.abs(answer) > 0.0).all()


def test_an_axis_that_carries_another_resonates_by_how_that_one_stands():
    servo = servo_file.load(CONFIG / 'servos' / 'pan_tilt_azimuth.yaml')
    found = []
    for angle in (0.0, np.pi / 2.0):
        form = linearise(servo, 'current', ('motor_speed',), usual_point(servo, coupled=angle))
        found += [z.frequency for z in form.zeros('motor_speed') if z.resonant]
    (carried,) = [p.name for p in servo.effects if p.effect.name == 'coupled_inertia']
    level, cosine, sine = (servo.values[f'effects.{carried}.{n}']
                           for n in ('level', 'cosine', 'sine'))
    least = servo.values['mechanism.load_inertia'] + level + np.hypot(cosine, sine)
    assert found[1] / found[0] == pytest.approx(
        np.sqrt((least + cosine) / (least - cosine)), rel=0.01)


def test_a_motor_that_turns_a_screw_keeps_its_radians():
    servo = servo_file.load(CONFIG / 'servos' / 'feed_drive.yaml')
    form = linearise(servo, 'current', ('motor_speed', 'load_speed'), usual_point(servo))
    assert (form.units['motor_speed'], form.units['load_speed']) == ('rad/s', 'm/s')


def recording_of(system, count=40000, noise=1e-5):
    """Return a recording of a system's angle under a held random command, by python-control."""
    random = np.random.default_rng(5)
    u = random.normal(size=count)
    t = np.arange(count) * PERIOD
    y = control.forced_response(control.sample_system(system, PERIOD, 'zoh'), t, u).outputs
    drift = 0.2 * t
    return Recording('made', PERIOD, {'voltage': u, 'motor_position':
                                      y + drift + noise * random.normal(size=count)})


def test_an_estimate_finds_the_response_the_resonance_and_its_own_coherence():
    s = control.tf('s')
    top, low = 2 * np.pi * 60.0, 2 * np.pi * 40.0
    plant = ((s**2 + 0.04 * low * s + low**2) / (s**2 + 0.04 * top * s + top**2)
             * 50.0 / (s * (s + 5.0)))
    recording = recording_of(control.ss(plant))
    found = estimate(recording, 'voltage', 'motor_speed', 2.0)
    assert found.averages == 38
    fair = found.clear & (found.frequency < 200.0)
    assert fair.sum() > 200
    held = control.sample_system(control.ss(plant), PERIOD, 'zoh')
    turn = 2j * np.pi * found.frequency[fair]
    expected = turn * np.array([held(z) for z in np.exp(turn * PERIOD)])
    assert np.median(np.abs(found.response[fair] / expected - 1.0)) < 0.03
    assert extremes(found) == (pytest.approx(40.0, rel=0.02), pytest.approx(60.0, rel=0.02))
    blurred = estimate(recording_of(control.ss(plant), noise=0.1), 'voltage', 'motor_speed', 2.0)
    assert np.median(blurred.coherence) < 0.5 < np.median(found.coherence)


def two_mass_bench():
    """Return the shipped two-mass servo with its coupling, at values fitted to its recording."""
    rigid = servo_file.load(CONFIG / 'servos' / 'two_mass.yaml')
    values = {**rigid.values, 'mechanism.rotor_inertia': 9.722e-4,
              'mechanism.load_inertia': 9.661e-4, 'mechanism.stiffness': 111.487,
              'mechanism.damping': 1.9e-6, 'effects.coulomb.level': 0.0,
              'effects.viscous.slope': 0.0279}
    soft = replace(rigid, mechanism=TwoInertia, values=values, tolerance={}, step=1e-4)
    return soft.with_effects(Placed('loop', find('current_lag'), 'current'),
                             values={'effects.loop.lag': 9.6e-4})


def test_the_two_mass_bench_resonates_where_its_recording_does(shared_data):
    servo = two_mass_bench()
    form = linearise(servo, 'voltage', ('motor_speed',), usual_point(servo))
    (low,) = [z.frequency for z in form.zeros('motor_speed') if z.resonant]
    (top,) = [p.frequency for p in form.poles('motor_speed') if p.resonant]
    assert (low, top) == (pytest.approx(54.1, abs=0.1), pytest.approx(76.3, abs=0.1))
    recording = import_table(shared_data / 'two_mass/MultisineTypeA.mat',
                             CONFIG / 'servos' / 'two_mass.yaml',
                             mapping=CONFIG / 'imports' / 'two_mass.yaml')
    found = estimate(recording, 'voltage', 'motor_speed', 1.0)
    assert extremes(found) == (pytest.approx(low, rel=0.03), pytest.approx(top, rel=0.02))
    fair = found.clear & (found.frequency < 45.0)
    ratio = found.response[fair] / form.response('motor_speed', found.frequency[fair],
                                                 recording.period)
    assert np.abs(20.0 * np.log10(np.abs(ratio))).max() < 1.5


def test_the_command_writes_page_pictures_and_matrices(tmp_path, capsys):
    file = tmp_path / 'masses.yaml'
    servo_file.save(machine(), file)
    assert main(['linearise', str(file), '--output', 'motor_speed', 'load_speed', '-o',
                 str(tmp_path / 'out')]) == 0
    said = capsys.readouterr().out
    assert 'antiresonance' in said and 'play' in said
    found = json.loads((tmp_path / 'out/linear.json').read_text())
    a = np.array(found['A'])
    roots = np.sort_complex(np.roots(found['transfer']['motor_speed']['denominator']))
    assert roots == pytest.approx(np.sort_complex(np.linalg.eigvals(a)), rel=1e-6)
    for name in ('bode_motor_speed', 'step_load_speed'):
        assert (tmp_path / f'out/{name}.png').read_bytes().startswith(b'\x89PNG')
    page = (tmp_path / 'out/linear.html').read_text()
    assert page.count('data:image/png') == 4 and 'http' not in page


def _still_recording():
    return Recording('dull', PERIOD, {'voltage': np.zeros(500), 'motor_position': np.zeros(500)})


@pytest.mark.parametrize(('call', 'said'), [
    (lambda s: linearise(s, 'reference_velocity', ('load_speed',), usual_point(s)),
     "there is no input 'reference_velocity' here; there are \\['voltage', 'current'"),
    (lambda s: linearise(s, 'voltage', ('speed',), usual_point(s)),
     "there is no output 'speed'; there are \\['motor_speed'"),
    (lambda s: linearise(s, 'voltage', ('load_speed',), usual_point(s, speed=0.0)),
     'at a speed of 0 friction holds the shafts'),
    (lambda s: usual_point(s, 'dry'), "there is no friction 'dry'; there are"),
    (lambda s: closed_loop(Servo('open', CurrentDrive, Rigid), 'reference_velocity',
                           ('load_speed',), usual_point(s), PERIOD), 'needs a controller'),
    (lambda s: linearise(Servo('open', CurrentDrive, Rigid), 'voltage', ('load_speed',),
                         usual_point(s, 'stuck')), 'rigid mechanism cannot move while'),
    (lambda s: estimate(_still_recording(), 'voltage', 'motor_speed'), 'voltage stands still'),
    (lambda s: estimate(_still_recording(), 'current', 'motor_speed'), 'current was not recorded'),
    (lambda s: estimate(_still_recording(), 'voltage', 'motor_speed', 9.0), 'a segment of 9 s'),
])
def test_what_cannot_be_is_refused_with_a_reason(call, said):
    with pytest.raises(ServoError, match=said):
        call(machine())
