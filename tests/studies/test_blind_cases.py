"""The cases of the blind check: what the rig is told, what is true of it, how severe it is."""

import numpy as np
import pytest

from servo_rig_driver.emulated.make_recording import make_recording
from servo_rig_driver.emulated.rig_file import load_rig
from servo_studies.blind_check import severity
from servo_studies.blind_check.case_kinds import KINDS
from servo_studies.blind_check.cases import case, of_plan
from servo_studies.blind_check.fault_tables import faults, machines, plans, severities
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import names
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import OUTPUTS

EFFECTS_OF_THE_TABLE = ('torque_constant_error', 'stiffness_error', 'rotor_inertia',
                        'load_inertia', 'controller_mismatch')


def test_it_draws_the_same_cases_from_the_same_seed():
    assert [c.as_json() for c in of_plan('development')] == [
        c.as_json() for c in of_plan('development')]
    assert len({c.name for c in of_plan('scored')}) == len(of_plan('scored'))


def test_it_keeps_scored_seeds_apart_from_those_of_development():
    drawn = {plan: {order['seed'] for c in of_plan(plan) for orders in c.recordings.values()
                    for order in orders} for plan in ('development', 'scored')}
    assert plans()['development']['seed'] != plans()['scored']['seed']
    assert len(drawn['development'] & drawn['scored']) <= 2


def test_it_begins_every_plan_with_a_fair_mix():
    for plan in ('development', 'scored'):
        whole = of_plan(plan)
        third = whole[:len(whole) // 3]
        for kind in KINDS:
            count = sum(c.kind == kind for c in whole)
            assert abs(sum(c.kind == kind for c in third) - count / 3) <= 2
        assert [c.name for c in whole] == [c.name for c in of_plan(plan)]


def test_it_tells_the_rig_only_what_the_rig_knows():
    rigs = {m.name: load_rig(m.rig_path) for m in machines().values()}
    for plan in plans():
        for one in of_plan(plan):
            rigs[one.machine].with_values(one.set)


@pytest.mark.parametrize('name', machines())
def test_it_has_servo_files_that_describe_their_rigs(name):
    machine = machines()[name]
    servo = servo_file.load(machine.servo_path)
    rig = load_rig(machine.rig_path)
    for path, said in machine.tolerated.items():
        for value in said:
            assert servo.values[value] == pytest.approx(rig.values[path], rel=1e-9), path
    for path in ('velocity_gain', 'velocity_integral', 'velocity_filter', 'command_limit'):
        said = {'velocity_gain': 'kp', 'velocity_integral': 'ki', 'velocity_filter': 'filter',
                'command_limit': 'limit'}[path]
        assert servo.values[f'controller.{said}'] == rig.values[f'drive.{path}']


def test_it_keeps_null_cases_inside_the_tolerances():
    for one in of_plan('scored'):
        if one.kind != 'null':
            continue
        machine = machines()[one.machine]
        servo = servo_file.load(machine.servo_path)
        off = []
        for path, said in machine.tolerated.items():
            for value in said:
                low, high = servo.tolerance[value]
                assert low <= one.set[path] <= high
                off.append(one.set[path] / servo.values[value] - 1.0)
        assert np.ptp(off) > 0.01
        assert set(one.set) == set(machine.set) | set(machine.tolerated)


@pytest.mark.long
@pytest.mark.parametrize('name', machines())
def test_it_has_null_cases_in_which_nothing_is_missing(name):
    one = next(c for c in of_plan('development') if (c.machine, c.kind) == (name, 'null'))
    machine = machines()[name]
    servo = servo_file.load(machine.servo_path).with_values(
        {value: one.set[path] for path, said in machine.tolerated.items() for value in said})
    for order in one.recordings['screen'][::2]:
        measured = make_recording(order['family'], machine.rig_path, None, order['settings'],
                                  [f'{k}={v!r}' for k, v in one.set.items()], 4.0)
        twin = simulate(servo, inputs_of(measured), 1e-3, initial_state(servo, 0.0, 0.0, 0.0))
        for channel, limit in (('torque', 0.04), ('current', 0.03)):
            left = means(measured[channel] - twin[:, OUTPUTS.index(channel)])
            assert np.std(left) < limit * np.std(measured[channel]), (order['family'], channel)


def means(values, over=10):
    return values[:len(values) // over * over].reshape(-1, over).mean(axis=1)


def test_it_only_expects_names_that_a_diagnosis_may_say():
    for fault in faults().values():
        for name in (*fault.names, *fault.also):
            known = name in names() or name in EFFECTS_OF_THE_TABLE
            assert known or name.startswith('parameter:'), f'{fault.name}: {name}'
        assert all(fault.also.values()), f'{fault.name}: an alias needs its reason'


def test_it_joins_only_faults_that_can_be_told_by_name():
    for one in of_plan('scored'):
        if one.kind in ('pair', 'triple'):
            assert len(one.truths) == {'pair': 2, 'triple': 3}[one.kind]
            accepted = [name for fault in one.faults for name in fault.accepted]
            assert len(accepted) == len(set(accepted))


def test_it_removes_the_cause_itself():
    for one in of_plan('scored'):
        assert bool(one.without) == (one.kind == 'removed')
        if one.kind == 'removed':
            assert set(one.faults[0].names) <= set(one.without)


def test_it_knows_a_severity_for_most_faults():
    for machine in machines().values():
        asked = {t.name for t in faults().values() if machine.name in t.start}
        assert len(asked - set(severities()[machine.name])) <= 2


def test_it_finds_the_severity_at_which_something_shows():
    value, where, tries = severity.smallest(lambda s: ((s / 0.3)**1.5, 'torque'), 5.0)
    assert value == pytest.approx(0.3, rel=0.1)
    assert (where, tries < 7) == ('torque', True)
    assert severity.smallest(lambda s: (0.1, 'torque'), 1.0)[0] is None


def test_it_names_near_cases_when_there_is_none():
    with pytest.raises(KeyError, match='gravity'):
        case('reduced', 'rv_plain-single-gravity')


@pytest.mark.parametrize('name', machines())
def test_no_severity_lies_within_what_is_taken_for_granted(name):
    machine = machines()[name]
    for fault, value in severities()[name].items():
        assert value >= 0.995 * severity.beyond(machine, faults()[fault]), fault
    assert severity.beyond(machine, faults()['sensor_delay']) == pytest.approx(1.05e-3)
    assert severity.beyond(machine, faults()['gravity']) == 0.0
