"""The diagnosis on recordings of real machines, each twin short of what the literature names."""

from dataclasses import replace
from pathlib import Path

import pytest

from servo_identify.gap.diagnose import diagnose
from servo_identify.importing import import_table
from servo_twin import servo_file

CONFIG = Path(__file__).resolve().parent.parent / 'config'


def machine(name):
    return CONFIG / 'servos' / f'{name}.yaml', CONFIG / 'imports' / f'{name}.yaml'


def without(servo, name):
    """Return a servo without one of its effects."""
    def others(table):
        return {k: v for k, v in table.items() if not k.startswith(f'effects.{name}.')}
    return replace(servo, effects=tuple(p for p in servo.effects if p.name != name),
                   values=others(servo.values), tolerance=others(servo.tolerance),
                   provenance=others(servo.provenance))


def test_a_viscous_axis_lacks_coulomb_friction_and_then_asymmetry(shared_data):
    file, mapping = machine('emps')
    recording = import_table(shared_data / 'emps' / 'DATA_EMPS.mat', file, mapping=mapping)
    report = diagnose([recording], without(servo_file.load(file), 'coulomb')).report
    print(report.verdict['sentence'])
    assert report.verdict['effects'] == ['coulomb_friction', 'asymmetric_friction']
    level = report.which[0].parameters['level']['value']
    assert level == pytest.approx(20.4, rel=0.05)  # published
    assert report.gap['shrink'] > 0.3


def test_a_coulomb_viscous_hobby_servo_lacks_load_dependent_friction(shared_data):
    file, mapping = machine('xl330')

    def run(name):
        recording = import_table(shared_data / 'xl330' / f'{name}.json', file, mapping=mapping)
        return replace(recording, name=name, family=name.split('_', 1)[1])

    report = diagnose(
        [run('kp100_sin_sin'), run('kp400_sin_time_square'), run('kp100_up_and_down')],
        servo_file.load(file), [run('kp400_sin_sin'), run('kp100_sin_time_square')],
        [run('kp400_up_and_down')]).report
    print(report.verdict['sentence'])
    assert report.which[0].effect == 'load_dependent_friction'
    assert report.which[0].interval[0] > 0.0
