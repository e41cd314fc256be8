"""`servo-identify diagnose`: what it writes, whose laws it takes in, what it refuses to judge."""

from dataclasses import replace
import json
from pathlib import Path
import re

import numpy as np
import pytest
from synthetic_recordings import PERIOD, sampled

from servo_identify.cli import main
from servo_identify.diagnose.mechanisms.every_hypothesis import check_without
from servo_twin.bag import write_recording
from servo_twin.cli import main as twin
from servo_twin.description import servo_file
from servo_twin.physics import catalogue
from servo_twin.physics.servo import Placed

FILE = Path(__file__).resolve().parents[2] / 'config' / 'servos' / 'rv_bench.yaml'
SERVO = servo_file.load(FILE)
WATER_HAMMER = '''
"""A pump on the load that resists most at one speed."""

from math import exp

from servo_twin.physics.effect import Parameter
from servo_twin.physics.ports import Friction


class WaterHammer(Friction):
    """Resistance with a peak at a speed."""

    source = 'the user'

    peak = Parameter(5.0, 'N m', (0.0, 1e4), 'Resistance at that speed.', off=0.0)
    middle = Parameter(0.3, 'rad/s', (0.01, 10.0), 'That speed.')

    @staticmethod
    def law(p, s, motion, h):
        return p.peak * exp(-((motion.speed - p.middle) / (0.3 * p.middle)) ** 2)
'''


def recorded(rig, seed, seconds=6.0):
    """Return a recording of a rig, moved by several sines."""
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    command = sum(1.1 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.5, 1.3, 3.1))
    return replace(sampled(rig, command, seed=seed), name=f'multisine_{seed}', family='multisine',
                   servo=SERVO.name)


@pytest.fixture(scope='module')
def good():
    return recorded(SERVO, 1)


@pytest.fixture
def refused(tmp_path, capfd):
    """Diagnose recordings that cannot be judged; return what was said."""
    def said(*recordings, servo=FILE):
        bags = [str(write_recording(tmp_path / f'bag{i}', one))
                for i, one in enumerate(recordings)]
        capfd.readouterr()
        status = main(['diagnose', *bags, '--servo', str(servo), '-o', str(tmp_path / 'out')])
        error = capfd.readouterr().err.strip()
        assert status == 2 and not (tmp_path / 'out' / 'report.json').exists()
        assert error.startswith('servo-identify diagnose: ') and len(error.splitlines()) == 1
        return error
    return said


def with_columns(recording, **columns):
    """Return a recording with some columns exchanged; a number stands for a constant."""
    full = {name: np.broadcast_to(np.asarray(value, dtype=float), len(recording)).copy()
            for name, value in columns.items()}
    return replace(recording, columns={**recording.columns, **full})


def test_it_refuses_recordings_of_different_machines(refused, good):
    assert 'different machines' in refused(good, replace(good, servo='another'))


def test_it_refuses_to_leave_out_what_is_no_cause_before_it_reads(tmp_path, capfd):
    bag = tmp_path / 'bag.mcap'
    bag.write_text('no bag, as reading it would find')
    assert main(['diagnose', str(bag), '--servo', str(FILE), '-o', str(tmp_path / 'out'),
                 '--without', 'parameter:rotor_inertia', 'gravitation']) == 2
    error = capfd.readouterr().err
    assert "no effect 'gravitation'" in error and "did you mean 'gravity'?" in error


@pytest.mark.parametrize('wrong, meant', [
    ('parameter:rotor_inertai', 'parameter:rotor_inertia'),
    ('parameter:viscous.slop', 'parameter:viscous.slope'),
    ('parameter:level', 'parameter:coulomb.level')])
def test_it_refuses_to_leave_out_a_value_that_the_servo_file_does_not_have(wrong, meant):
    with pytest.raises(ValueError, match=f"no value '{wrong}'.*did you mean '{meant}'"):
        check_without([wrong], SERVO)


def test_it_leaves_out_every_effect_that_the_page_of_symptoms_has():
    page = (FILE.parents[2] / 'docs' / 'symptoms.md').read_text()
    rows = {row.replace('-', '_') for row in re.findall(r'<a id="([\w-]+)"', page)}
    check_without(rows - {'rotor_inertia', 'load_inertia', 'side_of_the_friction'}, SERVO)


def test_it_refuses_a_rig_that_never_moves(refused, good):
    still = with_columns(good, voltage=0.0, motor_position=48.3, load_position=0.3, torque=0.0,
                         current=0.0)
    assert 'without excitation there is no verdict' in refused(still)


def test_it_refuses_a_command_at_its_limit_throughout(refused, good, tmp_path):
    limit = SERVO.values['controller.limit']
    way = np.where(np.arange(len(good)) % 1000 < 500, 1.0, -1.0)
    assert 'record with a smaller reference' in refused(with_columns(good, voltage=limit * way))


def test_it_refuses_a_recording_that_is_too_short(refused):
    assert 'at least 3 s are needed' in refused(recorded(SERVO, 1, seconds=1.0))


def test_it_refuses_encoders_without_a_number(refused, good):
    blind = with_columns(good, motor_position=np.nan, load_position=np.nan)
    assert 'neither motor_position nor load_position holds a number' in refused(blind)


def test_it_refuses_one_encoder_and_a_drive_without_a_number(refused, good):
    deaf = with_columns(good, voltage=np.nan, current=np.nan, load_position=np.nan)
    assert 'neither voltage nor current holds a number' in refused(deaf)


def test_without_a_drive_it_judges_the_load_and_the_transmission(good, tmp_path):
    bag = write_recording(tmp_path / 'bag', with_columns(good, voltage=np.nan, current=np.nan))
    assert main(['diagnose', str(bag), '--servo', str(FILE), '-o', str(tmp_path / 'out'),
                 '--no-page']) == 0
    report = json.loads((tmp_path / 'out' / 'report.json').read_text())
    assert report['verdict']['status'] == 'no_gap'
    assert {w['balance'] for w in report['where'] if w['verdict'] != 'not observable'} == {
        'load', 'transmission'}


def test_it_refuses_a_servo_file_whose_simulation_diverges(refused, good, tmp_path):
    file = tmp_path / 'stiff.yaml'
    stiff = replace(SERVO.with_values({'mechanism.stiffness': 1e9}), step=1e-3, tolerance={})
    servo_file.save(stiff, file)
    said = refused(good, servo=file)
    assert 'beyond' in said and 'step' in said


def test_it_says_what_a_silent_channel_keeps_from_it(good, tmp_path):
    mute = with_columns(good, torque=np.nan)
    bag = write_recording(tmp_path / 'bag', mute)
    assert main(['diagnose', str(bag), '--servo', str(FILE), '-o', str(tmp_path / 'out'),
                 '--no-page']) == 0
    report = json.loads((tmp_path / 'out' / 'report.json').read_text())
    assert report['verdict']['status'] == 'no_gap'
    assert any('torque sensor' in w for w in report['warnings'])
    assert {w['balance'] for w in report['where'] if w['verdict'] == 'not observable'} >= {
        'motor', 'load'}


@pytest.mark.long
@pytest.mark.slow
def test_a_law_of_the_user_takes_part_and_its_servo_file_runs(tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(catalogue, '_FOREIGN', {})
    folder = tmp_path / 'my_effects'
    folder.mkdir()
    (folder / 'water_hammer.py').write_text(WATER_HAMMER)
    catalogue.register(folder)
    rig = SERVO.with_effects(Placed('pump', catalogue.find('water_hammer'), 'load'),
                             values={'effects.pump.peak': 30.0})
    bags = [str(write_recording(tmp_path / f'bag{seed}', recorded(rig, seed)))
            for seed in (1, 2, 3)]
    monkeypatch.setattr(catalogue, '_FOREIGN', {})
    out = tmp_path / 'out'
    assert main(['diagnose', bags[0], '--accept', bags[1], '--report', bags[2], '--servo',
                 str(FILE), '-o', str(out), '--effects', str(folder)]) == 0
    report = json.loads((out / 'report.json').read_text())
    assert report['verdict']['effects'] == ['water_hammer']
    assert report['which'][0]['parameters']['peak']['value'] == pytest.approx(30.0, rel=0.1)
    assert 'water hammer' in (out / 'report.html').read_text()
    monkeypatch.setattr(catalogue, '_FOREIGN', {})
    replay = ['replay', bags[2], '--servo', str(out / 'augmented.yaml'), '--quiet']
    assert twin(replay) == 2 and 'water_hammer' in capfd.readouterr().err
    assert twin([*replay, '--effects', str(folder)]) == 0


@pytest.mark.long
@pytest.mark.slow
def test_it_writes_what_it_is_asked_for_and_says_with_its_status_that_a_gap_is_there(
        tmp_path, capfd):
    rig = SERVO.with_effects(Placed('e', catalogue.find('gravity'), 'load'),
                             values={'effects.e.cosine': 6.0})
    bags = [str(write_recording(tmp_path / f'bag{seed}', recorded(rig, seed)))
            for seed in (1, 2, 3)]
    out = tmp_path / 'made' / 'for it'
    status = main(['diagnose', *bags, '--servo', 'rv_bench', '-o', str(out), '--json', '-',
                   '--quiet', '--fail-on', 'gap', '--reach', 'travel=7,torque=60'])
    said = capfd.readouterr()
    report = json.loads(said.out)
    assert status == report['exit_status'] == 3
    assert all(f'warning: {one}\n' in said.err for one in report['warnings'])
    assert json.loads((out / 'report.json').read_text()).items() <= report.items()
    assert report['schema'] == 'servo_gap/2' and report['verdict']['status'] != 'no_gap'
    assert '<html' in (out / 'report.html').read_text()
    assert servo_file.load(out / 'augmented.yaml').effects[-1].name.startswith(
        report['which'][0]['effect'])


def test_it_refuses_a_reach_that_there_is_not(tmp_path):
    with pytest.raises(SystemExit):
        main(['diagnose', 'bag', '--servo', 'rv_bench', '-o', str(tmp_path), '--reach', 'hight=2'])
