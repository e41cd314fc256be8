"""The diagnosis on recordings of real machines, each twin short of what the literature names."""

from dataclasses import replace
from math import pi, sqrt
from pathlib import Path

import pytest

from servo_identify.data.table_import import import_table
from servo_identify.diagnose.diagnose import diagnose
from servo_twin.bag import write_recording
from servo_twin.cli import main as twin
from servo_twin.description import servo_file
from servo_twin.physics.mechanisms.two_inertia import TwoInertia

pytestmark = pytest.mark.slow

CONFIG = Path(__file__).resolve().parents[2] / 'config'


def machine(name):
    return CONFIG / 'servos' / f'{name}.yaml', CONFIG / 'imports' / f'{name}.yaml'


def without(servo, name):
    """Return a servo without one of its effects."""
    return servo.without_effects(lambda placed: placed.name == name)


@pytest.mark.long
def test_a_viscous_axis_lacks_coulomb_friction_and_then_asymmetry(shared_data):
    file, mapping = machine('emps')
    recording = import_table(shared_data / 'emps' / 'DATA_EMPS.mat', file, mapping=mapping)
    found = diagnose([recording], without(servo_file.load(file), 'coulomb'))
    report = found.report
    print(report.verdict['sentence'])
    assert report.verdict['effects'] == ['coulomb_friction', 'asymmetric_friction']
    level = report.which[0].parameters['level']['value']
    assert level == pytest.approx(20.4, rel=0.05)  # published
    assert report.gap['shrink'] > 0.9
    assert report.verdict['status'] == 'explained'


@pytest.mark.long
def test_a_coulomb_viscous_hobby_servo_lacks_load_dependent_friction(shared_data):
    file, mapping = machine('xl330')

    def run(name):
        recording = import_table(shared_data / 'xl330' / f'{name}.json', file, mapping=mapping)
        return replace(recording, name=name, family=name.split('_', 1)[1])

    screen = [run('kp100_sin_sin'), run('kp400_sin_time_square'), run('kp100_up_and_down')]
    accept = [run('kp400_up_and_down'), run('kp100_sin_time_square')]
    moving = [run('kp400_sin_sin')]
    found = diagnose(screen, servo_file.load(file), accept, moving)
    report = found.report
    print(report.verdict['sentence'])
    assert report.verdict['effects'] == ['load_dependent_friction']
    one, = report.which  # a log that is slower than the loop tells the law from a curve hardly
    share = one.parameters['share']['value'] if one.rung == 'law' else (
        one.curve['y'][-1] / one.curve['x'][-1])
    assert share == pytest.approx(0.35, abs=0.25)
    assert report.gap['shrink'] > 0.4 and report.which[0].interval[0] > 0.0
    again = diagnose(screen, found.augmented, accept, moving).report
    # what a curve instead of the law leaves is told with reserve at most
    assert all(one.confidence['mechanism'] < 0.5 for one in again.which)


@pytest.mark.long
def test_a_rigid_two_mass_bench_lacks_compliance_and_its_new_servo_file_runs(
        shared_data, tmp_path):
    file, mapping = machine('two_mass')
    recording = import_table(shared_data / 'two_mass' / 'MultisineTypeA.mat', file,
                             mapping=mapping)
    found = diagnose([recording], servo_file.load(file))
    report, cause, servo = found.report, found.report.which[0], found.augmented
    print(report.verdict['sentence'])
    assert cause.effect == 'stiffness_error' and cause.site == 'mesh'
    assert report.verdict['effects'][0] == 'stiffness_error'
    assert report.verdict['balance'] == 'transmission'
    assert report.gap['interval'][0] > 0.0 and report.gap['shrink'] > 0.05
    assert servo.mechanism is TwoInertia
    rotor, load, stiffness = (servo.values[f'mechanism.{name}'] for name in (
        'rotor_inertia', 'load_inertia', 'stiffness'))
    assert sqrt(stiffness / load) / (2 * pi) == pytest.approx(53.0, rel=0.05)  # published
    assert sqrt(stiffness / rotor + stiffness / load) / (2 * pi) == pytest.approx(77.0, rel=0.05)
    servo_file.save(servo, tmp_path / 'augmented.yaml')
    bag = write_recording(tmp_path / 'bag', recording)
    assert twin(['replay', str(bag), '--servo', str(tmp_path / 'augmented.yaml')]) == 0
