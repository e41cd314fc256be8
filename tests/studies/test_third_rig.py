"""The third rig: its physics against other people's formulas, its faults, its cases by seed."""

import ast
from dataclasses import replace
import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from servo_studies.third_rig import case_folder, fault_cases
from servo_studies.third_rig.bench_run import Fault, record
from servo_studies.third_rig.excitations import Excitation, excite
from servo_studies.third_rig.fault_cases import cases, KINDS, LISTED, UNLISTED
from servo_studies.third_rig.fault_terms import laws_of, MECHANISMS, memory_of, Table, Term
from servo_studies.third_rig.integrator import run
from servo_studies.third_rig.plant import Plant
from servo_studies.third_rig.rig_machine import within_tolerance
from servo_studies.third_rig.rig_machines import MACHINES, STYLES, told
from servo_studies.third_rig.servo_yaml import servo_file
from servo_studies.third_rig.terms import held, look, PORTS, stretch
from servo_studies.third_rig.visibility import Bench, SMALL, unit_amount

PACKAGE = Path(fault_cases.__file__).parent
FREE = Plant(ratio=1.0, rotor_inertia=0.01, load_inertia=0.03, stiffness=400.0, damping=0.0,
             torque_constant=1.0, gain=1.0)


def moved(plant, command, external=None, terms=(), memory=None, period=1e-4):
    """Run a bare plant open loop, one step a sample: motor, load, torque, current, command."""
    command = np.asarray(command, dtype=float)
    none = np.zeros(len(command))
    inputs = np.column_stack([none, none, none if external is None else external, command])
    return run(plant.as_record(), laws_of(terms), memory_of(memory or {}), inputs, none,
               none, np.zeros((len(command), 4)), 0.0, 0.0, period, 1)


@pytest.mark.long
@pytest.mark.slow
def test_a_machine_without_friction_keeps_its_energy():
    out = moved(FREE, np.where(np.arange(20_000) < 300, 2.0, 0.0))[400:]
    motor, load = (np.gradient(out[:, i], 1e-4) for i in (0, 1))
    energy = 0.5 * 0.01 * motor**2 + 0.5 * 0.03 * load**2 + 0.5 * out[:, 2]**2 / 400.0
    assert np.ptp(energy[5:-5]) < 2e-3 * energy.mean()


@pytest.mark.long
def test_it_rings_at_the_frequency_of_two_inertias_on_a_spring():
    torque = moved(FREE, np.where(np.arange(60_000) < 50, 2.0, 0.0))[100:, 2]
    crossings = np.flatnonzero(np.diff(np.sign(torque)) > 0)
    found = (len(crossings) - 1) / (crossings[-1] - crossings[0]) / 1e-4
    assert found == pytest.approx(np.sqrt(400.0 * (1 / 0.01 + 1 / 0.03)) / 2 / np.pi, rel=2e-3)


@pytest.mark.long
@pytest.mark.slow
def test_a_winding_turns_as_fast_as_its_volts_and_friction_say():
    plant = FREE._replace(ratio=5.0, damping=3.0, torque_constant=0.05, resistance=2.0,
                          inductance=1e-3, back_emf=0.05, rotor_inertia=1e-5, load_inertia=1e-3,
                          motor_coulomb=0.004, motor_viscous=2e-5, load_coulomb=0.05,
                          load_viscous=2e-3)
    out = moved(plant, np.full(10_000, 12.0))
    friction, viscous = 0.004 + 0.05 / 5, 2e-5 + 2e-3 / 25
    speed = (12.0 - 2.0 * friction / 0.05) / (0.05 + 2.0 * viscous / 0.05)
    assert np.gradient(out[:, 0], 1e-4)[-500:].mean() == pytest.approx(speed, rel=1e-5)
    assert out[-1, 3] == pytest.approx((friction + viscous * speed) / 0.05, rel=1e-5)


def test_it_stands_below_its_friction_and_stops_when_its_momentum_is_used_up():
    stuck = FREE._replace(motor_coulomb=0.5)
    assert np.all(moved(stuck, np.full(2000, 0.499))[:, 0] == 0.0)
    rigid = FREE._replace(stiffness=4e5, damping=60.0, load_coulomb=0.5)
    out = moved(rigid, np.where(np.arange(8000) < 1000, 2.5, 0.0))  # 2 N m, then 0.5 back
    assert np.flatnonzero(np.diff(out[:, 1]) != 0.0)[-1] == pytest.approx(5000, abs=20)


@pytest.mark.parametrize('half', [0.15, 0.4, 0.7])
def test_a_gap_has_the_describing_function_of_play(half):
    """Gelb, Vander Velde: Multiple-Input Describing Functions (1968), table of backlash."""
    amplitude, w = 0.02, 2 * np.pi * 2.0
    t = np.arange(20_000) * 1e-4
    plant = FREE._replace(rotor_inertia=1e4, load_inertia=1e-5, stiffness=50.0, damping=0.02,
                          load_coulomb=1e-3, gap=2 * half * amplitude)
    out = moved(plant, 1e4 * amplitude * w**2 * np.cos(w * t))   # motor: amplitude (1 - cos w t)
    last = slice(10_000, 20_000)
    gain = (np.mean(out[last, 1] * np.exp(-1j * w * t[last]))
            / np.mean(out[last, 0] * np.exp(-1j * w * t[last])))
    real = (np.pi / 2 + np.arcsin(1 - 2 * half)
            + 2 * (1 - 2 * half) * np.sqrt(half * (1 - half))) / np.pi
    assert gain == pytest.approx(real - 4j * half * (1 - half) / np.pi, abs=0.01)


def test_a_transmission_error_moves_the_load_as_its_curve_says():
    error = Table(lambda q: 1e-3 * np.sin(3 * q), 0.0, 2 * np.pi / 3, wraps=True)
    plant = FREE._replace(motor_viscous=0.2, damping=2.0, load_inertia=1e-4)
    out = moved(plant, np.full(30_000, 0.4), terms=(Term('load_error', (('load_angle', error),)),))
    lost = (out[:, 0] - out[:, 1] - out[:, 2] / 400.0)[20_000:]
    assert lost == pytest.approx(1e-3 * np.sin(3 * out[20_000:, 1]), abs=3e-5)


@pytest.mark.parametrize('mechanism', ['presliding_friction', 'hysteresis'])
def test_elements_with_memory_lose_energy_and_come_back_to_where_they_turned(mechanism):
    site = {'hysteresis': 'mesh'}.get(mechanism, 'load')
    for curve in set(MECHANISMS[mechanism].curves) - {'relaxing'}:
        change = Fault(mechanism, site, curve, 3).change(told('harmonic_joint', 'plain'), 0.5)
        row = memory_of(change.memory)[('motor', 'load', 'mesh').index(site)]
        reach = 3.0 * row[3:15].max()
        path = reach * np.sin(np.linspace(0.0, 6 * np.pi, 60_001))
        z, share = np.zeros(12), []
        for step in np.diff(path):
            stretch(row, z, step, 1e-4)
            share.append(held(row, z))
        share = np.array(share)
        assert np.sum(share[20_000:] * np.diff(path)[20_000:]) > 0.5 * reach, curve
        assert share[29_999] == pytest.approx(share[49_999], abs=1e-3), curve
        assert np.abs(share).max() <= 1.0 + 1e-9


def test_a_table_says_what_its_curve_says():
    for table, at in ((Table(np.cos, 0.0, 2 * np.pi, wraps=True), np.linspace(-20, 20, 99)),
                      (Table(np.sqrt, 0.0, 4.0, warp=4e-3), np.linspace(1e-3, 4.0, 99)),
                      (Table(lambda x: x**3, -2.0, 2.0), np.linspace(-2, 2, 99))):
        laws = laws_of((Term('load_torque', (('time', table),)),))
        where = int(laws[len(PORTS) + 1 + 3])
        found = np.array([look(laws, where, float(x)) for x in at])
        assert found[:, 0] == pytest.approx(table.law(at), abs=1e-4)
        rise = (table.law(at + 1e-6) - table.law(at - 1e-6)) / 2e-6
        assert found[5:-1, 1] == pytest.approx(rise[5:-1], abs=0.03)


def test_every_mechanism_has_its_curves_with_law_and_source_and_can_be_built():
    assert len(LISTED) == 37 and len(UNLISTED) >= 6
    built = set()
    for name, one in MECHANISMS.items():
        assert len(one.curves) >= (1 if one.balance else 3), name
        assert one.balance in ('', 'drive', 'motor', 'transmission', 'load', 'sensor')
        assert bool(one.balance) == bool(one.variables)
        assert all(one.balance or ';' in law for law in one.curves.values()), name
        for machine in (told(name, style) for name in MACHINES for style in STYLES):
            for curve, site in fault_cases._curves(name, machine, 'one'):
                change = Fault(name, site, curve, 5).change(machine, 0.1)
                assert np.all(np.isfinite(laws_of(change.terms)))
                assert np.all(np.isfinite(list(change.plant.values())))
                assert change.terms or change.plant or change.memory or change.delay
                built.add((name, curve))
    assert built == {(name, curve) for name, one in MECHANISMS.items() for curve in one.curves}


@pytest.fixture(scope='module')
def bench():
    machine = told('harmonic_joint', 'plain')
    return Bench(machine, [excite(machine, family, 3.0, np.random.default_rng(2))
                           for family in ('speed_ladder', 'load_steps')])


@pytest.mark.parametrize('fault', [
    Fault('coulomb_friction', 'load', 'seal'), Fault('cogging', 'motor', 'slots', 4),
    Fault('transmission_error', 'mesh', 'wave', 1), Fault('spring_load', 'load', 'torsion'),
    Fault('torque_sensor_gain', 'torque', 'constant'),
    Fault('parameter:gain', 'drive', 'constant', way=-1.0),
    Fault('drive_dead_band', 'drive', 'clipped'), Fault('sensor_delay', 'load_position', 'mean')],
    ids=lambda fault: fault.mechanism)
def test_severity_one_shows_a_little_and_four_shows_four_times_that(bench, fault):
    unit = unit_amount(bench, fault)
    one, four = bench.shows([(fault, unit)]), bench.shows([(fault, 4 * unit)])
    assert 0.8 * SMALL <= one <= 1.2 * SMALL
    assert four == pytest.approx(4 * one, rel=0.2)


@pytest.mark.parametrize('name', MACHINES)
def test_a_machine_is_within_the_tolerances_of_its_servo_file(name):
    from servo_twin.description.servo_file import loads
    for style in STYLES:
        file = loads(servo_file(told(name, style)))
        for seed in range(4):
            drawn = within_tolerance(told(name, style), np.random.default_rng(seed))
            true = loads(servo_file(drawn))
            assert set(true.values) == set(file.values)
            for path, value in file.values.items():
                low, high = file.tolerance.get(path, (value, value))
                assert np.all(low <= np.asarray(true.values[path])) and np.all(
                    np.asarray(true.values[path]) <= high), path


def test_a_twin_with_the_true_values_follows_it_within_a_thousandth():
    from servo_twin.description.servo_file import loads
    from servo_twin.physics.simulate import initial_state, inputs_of, simulate
    from servo_twin.recording.recording import COLUMNS
    machine = within_tolerance(told('gear_motor', 'plain'), np.random.default_rng(8))
    given = excite(machine, 'load_steps', 2.0, np.random.default_rng(1))
    command = 2.0 * np.sin(np.arange(2000) * 0.011) + given.external
    columns = record(machine, given._replace(command=command), seed=None)
    servo = loads(servo_file(machine))
    inputs = inputs_of({name: columns.get(name, np.full(2000, np.nan)) for name in COLUMNS})
    twin = simulate(servo, inputs, machine.period, initial_state(
        servo, columns['motor_position'][0], columns['load_position'][0]))
    for i, name in ((0, 'motor_position'), (1, 'load_position'), (3, 'current')):
        gap = np.sqrt(np.mean((twin[:, i] - columns[name])[50:]**2))
        assert gap < 3e-3 * np.std(columns[name]), name


def test_cases_are_the_same_for_a_seed_and_balanced():
    first, again, other = cases(4), cases(4, 30), cases(5, 30)
    assert first[:30] == again and [one.servo for one in again[:5]] == [
        one.servo for one in first[:5]]
    assert [one.faults for one in first[:30]] != [one.faults for one in other]
    assert {kind: sum(one.kind == kind for one in first) for kind in KINDS} == KINDS
    assert {one.faults[0].mechanism for one in first if one.kind == 'one'} == set(LISTED)
    assert {one.machine.name for one in first if one.kind == 'nothing lacks'} == set(MACHINES)
    assert all(not one.truth for one in first if one.kind in ('nothing lacks', 'unlisted'))
    for one in first:
        assert one.told.noise == one.machine.noise and one.told.name == one.machine.name
        if one.kind == 'own kind':
            assert one.faults[0].mechanism in {known.effect for known in one.machine.known}


def test_a_case_is_written_as_a_folder_that_tells_its_truth(tmp_path):
    case = next(one for one in cases(1)
                if one.kind == 'one' and one.machine.name == 'leg_actuator')
    case = replace(case, families=case.families[:2], replicates=1, seconds=2.0)
    place = case_folder.write_case(case, tmp_path)
    again = case_folder.write_case(replace(case), tmp_path / 'again')
    truth = json.loads((place / 'truth.json').read_text())
    assert [tuple(one) for one in truth['truth']] == case.truth and truth['shows'] > 0.0
    listed = yaml.safe_load((place / 'recordings.yaml').read_text())
    assert {one['family'] for one in listed.values()} == set(case.families)
    for name in listed:
        assert (place / name).read_bytes() == (again / name).read_bytes()
        table = np.genfromtxt(place / name, delimiter=',', names=True)
        assert {'t', 'voltage', 'motor_position', 'external_torque'} <= set(table.dtype.names)
        assert len(table) == round(2.0 / case.machine.period)
        assert np.diff(table['t']) == pytest.approx(case.machine.period)


def test_readings_are_whole_counts_with_noise_and_another_seed_gives_another():
    machine = told('gimbal', 'plain')
    still = Excitation(*np.zeros((4, 400)))  # the loop is open, or it would move with the noise
    one, two = record(machine, still, seed=1), record(machine, still, seed=2)
    counts = one['motor_position'] / machine.plant.motor_count
    assert counts == pytest.approx(np.round(counts), abs=1e-6)
    assert not np.array_equal(one['current'], two['current'])
    assert np.std(one['current']) == pytest.approx(machine.sensor_noise('current'), rel=0.2)


def test_it_imports_no_other_package_of_this_house():
    for path in PACKAGE.glob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [one.name for one in node.names] if isinstance(node, ast.Import) else (
                [node.module or ''] if isinstance(node, ast.ImportFrom) else [])
            assert all(name.split('.')[0] in {
                '__future__', 'argparse', 'ast', 'collections', 'dataclasses', 'functools',
                'inspect', 'json', 'math', 'numba', 'numpy', 'pathlib', 're', 'sys', 'time',
                'typing', 'yaml'} or getattr(node, 'level', 0) == 1 for name in names), path
