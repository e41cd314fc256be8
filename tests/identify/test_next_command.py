"""The command that records what a diagnosis asks for next: as it is pasted, it ..."""

import argparse
from dataclasses import replace
import shlex

from bench_recording import bench_recording, SERVO
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.commands.experiment import add_arguments, planned
from servo_identify.data.reading import read_recordings
from servo_identify.diagnose.answer.candidate_runs import DURATION
from servo_identify.experiment.next_command import emulated_note, next_command
from servo_identify.experiment.run_limits import limits_of
from servo_identify.experiment.usual_limits import USUAL
from servo_twin.description.servo_file import load
from servo_twin.description.shipped import shipped

CHOSEN = {
    'speed_ladder': {'speeds': [0.02, 0.1, 0.4], 'acceleration': 4.0},
    'slow_reversals': {'speed': 0.05, 'period': 2.5},
    'load_steps': {'speed': 0.1, 'torque': 30.0, 'acceleration': 4.0},
    'chirp': {'amplitude': 1.2, 'from': 0.5, 'to': 15.0},
    'multisine': {'amplitude': 1.0, 'from': 0.5, 'to': 10.0, 'lines': 8},
    'sine': {'amplitude': 1.5, 'frequency': 0.5}}
BENCH = load(SERVO)


@pytest.fixture(scope='module')
def emulated():
    """Return a recording whose note says which emulated rig it is of."""
    note = emulated_note(shipped('rigs/rv_bench.yaml'), ['friction.level=1.5'])
    return replace(bench_recording(3.0), note=note)


def command_for(family, recording, servo=BENCH):
    chosen = {'family': family, 'settings': {**CHOSEN[family], 'duration': DURATION}}
    return shlex.split(next_command(chosen, servo, SERVO, [recording]))


@pytest.mark.parametrize('family', ['speed_ladder', 'load_steps', 'chirp'])
def test_it_records_the_family_on_the_same_emulated_rig(family, emulated, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    program, *words = command_for(family, emulated)
    assert program == 'servo-identify'
    assert words[-5:] == ['--headless', '--rig', 'rv_bench', '--set', 'friction.level=1.5']
    assert main(words) == 0
    one, = read_recordings(['next/*'], SERVO)
    assert DURATION - 0.1 < one.duration < DURATION + 1.5
    assert one.note == emulated.note  # so that the next command asks for this rig again
    settings = CHOSEN[family]
    if 'amplitude' in settings:
        assert np.abs(one['voltage']).max() == pytest.approx(settings['amplitude'], rel=0.05)
    else:
        top = max(settings.get('speeds', [settings.get('speed')]))
        assert np.nanmax(np.abs(one['reference_velocity'])) == pytest.approx(top, rel=0.05)
    if 'torque' in settings:
        assert np.abs(one['external_torque']).max() == pytest.approx(settings['torque'], rel=0.05)


@pytest.mark.parametrize('family', CHOSEN)
def test_it_is_within_its_own_limits_beside_a_rig_that_runs(family, emulated):
    fast = replace(emulated, note='', columns={  # of a machine that is faster than most
        **emulated.columns, **{name: 30.0 * emulated[name] for name in (
            'motor_position', 'load_position', 'current', 'torque')}})
    words = command_for(family, fast)
    assert '--headless' not in words
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    told = parser.parse_args(words[2:])
    limits = limits_of(BENCH, {name: getattr(told, f'max_{name}') for name in USUAL})
    assert limits.speed > 3.0  # what is usual
    run, = planned(told, BENCH, limits)
    assert DURATION - 0.1 < run.duration < DURATION + 1.5


def test_it_is_nothing_where_nothing_is_to_be_recorded(emulated):
    assert next_command({}, BENCH, SERVO, [emulated]) == ''
    assert next_command({'family': '', 'settings': {}}, BENCH, SERVO, [emulated]) == ''
