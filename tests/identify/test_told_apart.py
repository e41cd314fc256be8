"""A fit of values that the recordings cannot tell apart ..."""

import json

import numpy as np
import pytest
from scipy.optimize import minimize

from servo_identify.cli import main
from servo_identify.fit.told_apart import alike

CONSTANT, ROTOR, LOAD, RATIO = 0.045, 3.2e-5, 0.012, 50.0
GIVEN = {'drive.torque_constant': 1.034 * CONSTANT, 'mechanism.rotor_inertia': 0.97 * ROTOR,
         'mechanism.load_inertia': 1.02 * LOAD}


@pytest.fixture(scope='module')
def table(tmp_path_factory):
    """Record a motor without friction and without a torque sensor, 4 s at 500 Hz."""
    chance, count, period = np.random.default_rng(1), 2.0 * np.pi / 4096, 1e-4
    angle = speed = command = 0.0
    rows = []
    for k, t in enumerate(np.arange(0.0, 4.0, period)):
        current = (command - CONSTANT * speed) / 2.1
        if k % 20 == 0:  # read first, then command
            target = 0.6 * np.sin(2.5 * t) + 0.3 * np.sin(8.0 * t)
            command = np.clip(60.0 * (target - angle / RATIO), -24.0, 24.0)
            rows.append((t, command, current + 0.005 * chance.standard_normal(),
                         count * round(angle / count)))
            current = (command - CONSTANT * speed) / 2.1
        speed += period * CONSTANT * current / (ROTOR + LOAD / RATIO**2)
        angle += period * speed
    path = tmp_path_factory.mktemp('motor') / 'run.csv'
    np.savetxt(path, rows, delimiter=',', comments='',
               header='t [s],voltage [V],current [A],motor_position [rad]')
    return path


def fitted(table, folder, tolerances, *more):
    """Return the report of a fit of a file that init wrote, with other tolerances."""
    servo, new, report = (folder / name for name in ('s.yaml', 'new.yaml', 'report.json'))
    units = ('N m/A', 'kg m2', 'kg m2')
    values = [word for (path, value), unit in zip(GIVEN.items(), units, strict=True)
              for word in ('--' + path.partition('.')[2].replace('_', '-'), f'{value:.6g} {unit}')]
    assert main(['init', str(table), '-o', str(servo), '--no-questions', '--drive', 'voltage',
                 '--resistance', '2.1 ohm', '--back-emf', f'{CONSTANT} V s/rad', '--ratio', '50',
                 '--tolerance', '10 %', *values]) == 0
    text = servo.read_text()
    for path, share in tolerances.items():
        assert f'{path}: 10 %' in text
        text = text.replace(f'{path}: 10 %', f'{path}: {share}')
    servo.write_text(text)
    assert main(['fit', str(table), '--servo', str(servo), '-o', str(new), '--report',
                 str(report), *more]) == 0
    return json.loads(report.read_text())


def nearest(share):
    """Return the changes in shares of the values that are right and smallest in tolerances."""
    given = np.array(list(GIVEN.values()))
    inertia = (ROTOR + LOAD / RATIO**2) / CONSTANT

    def wrong(x):
        constant, rotor, load = given * (1.0 + share * x)
        return (rotor + load / RATIO**2) / constant / inertia - 1.0

    answer = minimize(lambda x: x @ x, np.zeros(3), constraints={'type': 'eq', 'fun': wrong},
                      bounds=[(-1.0, 1.0)] * 3, options={'ftol': 1e-14})
    return answer.x * share


@pytest.fixture(scope='module')
def report(table, tmp_path_factory):
    return fitted(table, tmp_path_factory.mktemp('same'), {})


def test_it_names_them_and_the_combination_that_is_known(report):
    said, = (w for w in report['warnings'] if 'cannot be told apart' in w)
    assert all(path in said for path in GIVEN)
    assert 'one combination' in said
    rotor, load = GIVEN['mechanism.rotor_inertia'], GIVEN['mechanism.load_inertia'] / RATIO**2
    assert (f'torque_constant - {rotor / (rotor + load):.2f} rotor_inertia - '
            f'{load / (rotor + load):.2f} load_inertia') in said
    assert not any('is not identified' in w and path in w for w in report['warnings']
                   for path in GIVEN)


def test_it_takes_the_values_nearest_to_the_given_ones(report):
    moved = [report['values'][path] / GIVEN[path] - 1.0 for path in GIVEN]
    assert moved == pytest.approx(nearest(0.1), abs=4e-3)
    assert report['rms']['motor_position'] < 1.1 * report['noise']['motor_position']


def test_it_goes_farther_than_the_nearest_where_a_tolerance_is_in_the_way(table, tmp_path):
    shares = np.array([0.02, 0.05, 0.1])
    found = fitted(table, tmp_path, {'drive.torque_constant': '2 %',
                                     'mechanism.rotor_inertia': '5 %'})
    moved = [found['values'][path] / GIVEN[path] - 1.0 for path in GIVEN]
    assert nearest(shares)[1] > 0.04  # the rotor takes what the constant must not
    assert found['rms']['motor_position'] < 1.1 * found['noise']['motor_position']
    assert moved == pytest.approx(nearest(shares), abs=5e-3)


def test_it_names_as_many_combinations_as_there_are():
    apart = np.linalg.qr(np.array([[1.0, 1.0, 1.0, 0.0]]).T)[0]
    said, = alike(apart, np.ones(4), np.ones(4), ['a.level', 'b.level', 'c.slope', 'd.gain'])
    assert 'a.level, b.level and c.slope cannot' in said and '2 combinations' in said
    assert 'gain' not in said and said.count(' - ') == 2
    said, = alike(np.array([[1.0, 0.0]]).T, np.ones(2), np.ones(2), ['a.level', 'b.level'])
    assert said.startswith('a.level is not determined') and 'b.level' not in said
    weak = np.array([[0.01, 1.0, 1.0]]).T
    said, = alike(weak / np.linalg.norm(weak), np.array([200.0, 1.0, 1.0]), np.ones(3),
                  ['a.level', 'b.level', 'c.slope'])
    assert said.startswith('b.level and c.slope cannot be told apart')
    assert alike(np.zeros((2, 0)), np.ones(2), np.ones(2), ['a', 'b']) == []
