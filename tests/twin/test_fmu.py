"""A mechanism that comes as an FMU: beside the built-in one of the same values."""

from dataclasses import replace
import subprocess
import sys

from fmu_maker import made, mapped, SERVO, servo_of
import numpy as np
import pytest

from servo_identify.fit.output_error import fit
from servo_twin.bag import write_recording
from servo_twin.cli import main
from servo_twin.description import servo_file
from servo_twin.fmu.fmu_file import FmuError, FmuFailure
from servo_twin.linear.operating_point import usual_point
from servo_twin.linear.state_space import linearise
from servo_twin.lockstep.lockstep import Lockstep, Settings, warm_up
from servo_twin.lockstep.twin import Twin
from servo_twin.lockstep.whole_recording import answer
from servo_twin.physics.servo import ServoError
from servo_twin.physics.simulate import initial_state, inputs_of, simulate, simulate_many
from servo_twin.physics.state import INPUTS, LOAD_ANGLE, MOTOR_SPEED
from servo_twin.recording.joined_samples import samples_of
from servo_twin.recording.recording import Recording

PERIOD = 1e-3
BUILT_IN = '  type: two_inertia\n  damping: 2.0\n  stiffness: 4.0e+3'
RIGID = '  type: rigid'


@pytest.fixture(scope='session')
def fmus(tmp_path_factory):
    """Return the FMUs of both versions and of both kinds, made once."""
    folder = tmp_path_factory.mktemp('fmus')
    return {'two2': made(folder, 2), 'two3': made(folder, 3),
            'one2': made(folder, 2, rigid=True), 'one3': made(folder, 3, rigid=True)}


def columns(count=1500, **more):
    """Return the columns of a run that reverses under an external torque."""
    t = np.arange(count) * PERIOD
    filled = {name: np.full(count, np.nan) for name in INPUTS}
    filled['voltage'] = 3.0 * np.sin(2.0 * np.pi * 2.0 * t) * (t > 0.1)
    filled['external_torque'] = 0.4 * np.sin(2.0 * np.pi * 3.1 * t)
    filled['reference_velocity'] = 0.2 * np.sin(2.0 * np.pi * 1.3 * t)
    return {**filled, **more}


def run(servo, mode='measured_input', **more):
    """Run a servo from angles of its own."""
    return simulate(servo, inputs_of(columns(**more)), PERIOD, initial_state(servo, 4.0, 0.7),
                    mode)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('version', ['two2', 'two3'])
@pytest.mark.parametrize('mode', ['measured_input', 'closed_loop'])
def test_an_fmu_of_two_inertias_goes_as_the_built_in_ones(fmus, version, mode):
    theirs, ours = run(servo_of(mapped(fmus[version])), mode), run(servo_of(BUILT_IN), mode)
    assert np.ptp(ours[:, 1]) > 0.01
    for column in (0, 1, 3, 4):
        assert np.abs(theirs[:, column] - ours[:, column]).max() < 1e-9
    # the torque is told at the end of the step, where ours is that of its beginning
    assert np.abs(theirs[:, 2] - ours[:, 2]).max() < 0.02 * np.ptp(ours[:, 2])


@pytest.mark.long
@pytest.mark.parametrize('version', ['one2', 'one3'])
def test_an_fmu_that_moves_as_one_goes_as_the_rigid_mechanism(fmus, version):
    outputs = '{motor_angle: phi_m, motor_speed: w_m, load_angle: phi_l, load_speed: w_l}'
    theirs, ours = run(servo_of(mapped(fmus[version], outputs=outputs))), run(servo_of(RIGID))
    assert np.ptp(ours[:, 1]) > 0.01
    for column in (0, 1, 3):
        assert np.abs(theirs[:, column] - ours[:, column]).max() < 1e-9
    assert np.abs(theirs[:, 2] - ours[:, 2]).max() < 1e-6 * np.ptp(ours[:, 2])


@pytest.mark.long
@pytest.mark.slow
def test_speeds_and_one_angle_may_be_missing_and_a_sign_turned(fmus):
    outputs = '{motor_angle: phi_m, load_angle: phi_l, torque: tau}'
    inputs = '{motor_torque: tau_m, external_torque: {variable: tau_ext, factor: 1.0}}'
    servo = servo_of(mapped(fmus['two2'], inputs, outputs))
    assert np.abs(run(servo)[:, 1] - run(servo_of(BUILT_IN))[:, 1]).max() < 1e-4
    turned = servo_of(mapped(fmus['two2'], inputs.replace('1.0', '-1.0')))
    against = run(turned, external_torque=-columns()['external_torque'])
    plain = run(servo_of(mapped(fmus['two2'])))
    # friction and the spring of the load turn with it: only the external torque may be compared
    assert np.abs(against - plain).max() > 0.0


def test_a_stuck_shaft_stays_where_it_is(fmus):
    quiet = {'external_torque': np.zeros(1500), 'voltage': np.full(1500, 0.1)}
    y = run(servo_of(mapped(fmus['two2'])).with_values({'effects.spring.stiffness': 0.0}), **quiet)
    assert np.ptp(y[200:, 1]) < 1e-12


def recording():
    """Return the recording of a rig that is the built-in mechanism, moving from the beginning."""
    servo = servo_of(BUILT_IN)
    given = columns()
    y = run(servo)
    names = ('motor_position', 'load_position', 'torque', 'current')
    return Recording('rig', PERIOD, {
        'voltage': given['voltage'], 'external_torque': given['external_torque'],
        'reference_velocity': given['reference_velocity'],
        **{name: y[:, i] for i, name in enumerate(names)}}, servo='screw')


@pytest.mark.parametrize('version', ['two2', 'two3'])
def test_in_lockstep_the_cut_into_blocks_changes_no_bit_and_it_follows_the_rig(fmus, version):
    servo, rig = servo_of(mapped(fmus[version])), recording()
    whole = answer(rig, servo)
    assert whole.restarts == 0
    again = answer(rig, servo)
    samples = samples_of(rig.columns)
    line = Lockstep(servo, PERIOD, Settings())
    pieces = [line.step(k, 0, samples[k:k + 7])[0].values for k in range(0, len(samples), 7)]
    for name, column in zip(whole.prediction, np.vstack(pieces).T, strict=True):
        assert (whole.prediction[name] == column).all()
        assert (whole.prediction[name] == again.prediction[name]).all()
    off = np.abs(whole.prediction['load_position'] - rig['load_position'])
    assert off[150:].max() < 0.1 * np.ptp(rig['load_position'])  # it guessed the speed it began at
    assert off[-200:].max() < 0.01 * np.ptp(rig['load_position'])


def test_a_gap_begins_the_fmu_anew_at_the_angles_that_are_measured(fmus):
    servo, rig = servo_of(mapped(fmus['two2'])), recording()
    samples = samples_of(rig.columns)
    twin = Twin(servo, PERIOD, bridge=5)
    twin.step(0, samples[:600])
    y = twin.step(700, samples[700:1200])
    assert twin.restarts == 1
    assert np.abs(y[150:, 1] - rig['load_position'][850:1200]).max() < 0.02 * np.ptp(
        rig['load_position'])


def test_the_command_replays_a_bag_and_again_to_the_last_bit(fmus, tmp_path, capsys):
    write_recording(tmp_path / 'bag', recording(), 100)
    file = tmp_path / 'screw.yaml'
    (tmp_path / 'mine.fmu').write_bytes(fmus['two3'].read_bytes())
    file.write_text(SERVO.format(mechanism=mapped('mine.fmu'), step=1e-4, more=''))
    assert main(['replay', str(tmp_path / 'bag'), '--servo', str(file), '-o',
                 str(tmp_path / 'answered'), '--quiet']) == 0
    assert main(['replay', str(tmp_path / 'answered'), '--servo', str(file), '--compare']) == 0
    assert 'identical to the last bit' in capsys.readouterr().out


def test_a_bag_runs_no_code_and_a_servo_file_says_so_before_it_does(fmus, tmp_path, capfd):
    file = tmp_path / 'screw.yaml'
    (tmp_path / 'own.fmu').write_bytes(fmus['two2'].read_bytes())
    text = SERVO.format(mechanism=mapped(str(tmp_path / 'own.fmu')), step=1e-4, more='')
    file.write_text(text)
    write_recording(tmp_path / 'bag', replace(recording(), servo_file=text), 100)
    assert main(['replay', str(tmp_path / 'bag'), '--quiet']) == 2
    told = capfd.readouterr().err
    assert 'give it by --servo' in told and 'is run in this process' not in told
    assert main(['replay', str(tmp_path / 'bag'), '--servo', str(file), '--quiet']) == 0
    assert 'own.fmu: the code of this FMU is run in this process' in capfd.readouterr().err


def test_a_copy_of_a_state_goes_on_where_the_fmu_can_return_and_is_refused_where_not(
        fmus, tmp_path):
    u = inputs_of(columns(400))
    for fmu, able in ((fmus['two2'], True), (fmus['two3'], True),
                      (made(tmp_path, 2, returns=False), False)):
        servo = servo_of(mapped(fmu))
        x = initial_state(servo, 4.0, 0.7)
        simulate(servo, u[:200], PERIOD, x)
        copy = x.copy()
        first = simulate(servo, u[200:], PERIOD, x)
        if able:
            assert (simulate(servo, u[200:], PERIOD, copy) == first).all()
        else:
            with pytest.raises(FmuError, match='does not offer to get and set its state'):
                simulate(servo, u[200:], PERIOD, copy)


def test_many_runs_from_one_beginning_run_beside_each_other(fmus):
    servo, u = servo_of(mapped(fmus['two2'])), inputs_of(columns(300))
    x = initial_state(servo, 4.0, 0.7)
    thetas = [servo.with_values({'mechanism.stiffness': c}).theta for c in (2e3, 4e3, 8e3)]
    several = simulate_many(servo, u, PERIOD, x, thetas)
    for found, theta in zip(several, thetas, strict=True):
        assert (found == simulate(servo, u, PERIOD, x.copy(), theta=theta)).all()
    assert np.abs(several[0] - several[2]).max() > 1e-6


def test_a_tunable_parameter_changes_while_it_runs_and_another_begins_it_anew(fmus):
    servo, rig = servo_of(mapped(fmus['two2'])), recording()
    samples = samples_of(rig.columns)
    twin = Twin(servo, PERIOD)
    twin.step(0, samples[:500])
    instance = twin._x[servo.memories()['mechanism']][0]
    twin.set({'mechanism.stiffness': 2e3})
    soft = twin.step(500, samples[500:600])
    assert twin._x[servo.memories()['mechanism']][0] == instance
    before = twin._x.copy()
    twin.set({'mechanism.load_inertia': 0.6})
    y = twin.step(600, samples[600:700])
    assert twin._x[servo.memories()['mechanism']][0] != instance
    assert y[0, 1] == before[LOAD_ANGLE]
    assert np.isfinite(soft).all() and np.isfinite(y).all() and twin.restarts == 0


@pytest.mark.parametrize('version', [2, 3])
def test_a_step_that_fails_says_when_and_why_and_a_twin_begins_anew(fmus, version):
    servo = servo_of(mapped(fmus[f'two{version}'])).with_values({'mechanism.fails': 0.3})
    with pytest.raises(FmuFailure, match=r'two_?|screw.*its step failed \(error\) at t = 0.3'
                                         r'.* it said: the nut ran off its thread at '):
        run(servo)
    found = answer(recording(), servo)
    assert found.restarts == 3  # 1.5 s, 0.1 s of which it catches up each time
    assert 'the nut ran off its thread' in found.warnings[0]


@pytest.mark.long
def test_its_linear_form_is_that_of_the_built_in_mechanism(fmus):
    forms = [linearise(servo, 'voltage', ('motor_speed', 'load_position'),
                       usual_point(servo, 'none'))
             for servo in (servo_of(mapped(fmus['two2'])), servo_of(BUILT_IN))]
    frequency = np.geomspace(0.5, 300.0, 30)
    for output in forms[0].outputs:
        theirs, ours = (form.response(output, frequency) for form in forms)
        assert np.abs(theirs / ours - 1.0).max() < 1e-5


def test_a_servo_file_with_an_fmu_reads_back_and_knows_another_fmu(fmus, tmp_path):
    mine = tmp_path / 'mine.fmu'
    mine.write_bytes(fmus['two2'].read_bytes())
    servo = servo_of(mapped('mine.fmu'), folder=tmp_path)
    text = servo_file.dumps(servo)
    assert servo_file.loads(text) == servo
    assert servo.unit('mechanism.load_inertia') == 'kg m2'
    mine.write_bytes(fmus['one2'].read_bytes())
    with pytest.raises(ServoError, match='another FMU than the servo file was made with'):
        servo_file.loads(text)


def test_fmpy_is_imported_only_where_a_servo_file_names_an_fmu():
    program = ('import sys\nfrom servo_twin.commands import replay\n'
               'from servo_twin.description import servo_file, shipped\n'
               'servo_file.load(shipped.servo_at("rv_plain"))\nprint("fmpy" in sys.modules)')
    said = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True)
    assert said.stdout.strip() == 'False', said.stderr


def test_a_servo_that_cannot_begin_is_refused_before_it_runs(fmus):
    servo = servo_of(mapped(fmus['two2'])).with_values({'mechanism.fails': 0.0})
    warm_up(servo)  # a step that fails is met by beginning again; the beginning itself is not
    y = run(servo_of(mapped(fmus['two2'], start='{}')))
    assert y[0, 1] == 0.7 and y[0, 0] == 4.0  # its own angles are counted from the state's


def test_a_step_that_its_own_solver_cannot_take_is_refused(fmus):
    servo = servo_of(mapped(fmus['two2']))
    u = inputs_of(columns(10))
    x = initial_state(servo)
    x[MOTOR_SPEED] = 3.0
    assert np.isfinite(simulate(servo, u, PERIOD, x)).all()
    fmu = servo.mechanism.fmu
    object.__setattr__(fmu, 'variable_step', False)
    object.__setattr__(fmu, 'internal_step', 3e-5)
    try:
        with pytest.raises(FmuError, match='a step of 0.0001 s is no multiple of its own step'):
            simulate(servo, u, PERIOD, initial_state(servo))
    finally:
        object.__setattr__(fmu, 'variable_step', True)
        object.__setattr__(fmu, 'internal_step', None)


def test_its_parameters_are_found_by_a_fit(fmus):
    servo = servo_of(mapped(fmus['two3'])).with_values({'mechanism.stiffness': 3e3})
    found = fit(servo, [recording()], ['mechanism.stiffness', 'effects.dry.level'], horizon=0.5,
                delays=False, channels=('motor_position', 'load_position'))
    assert found.values['mechanism.stiffness'] == pytest.approx(4e3, rel=0.02)
    assert found.values['effects.dry.level'] == pytest.approx(0.6, rel=0.01)
