"""The geared DC motor of paper 003: its excitations, its split, its page, on little of each."""

from pathlib import Path

import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.experiment.procedures import Choices, PROCEDURES
from servo_identify.learn.free_run import free_runs
from servo_identify.learn.friction.friction_dataset import dataset_of, SEQUENCE
from servo_identify.learn.friction.friction_samples import friction_of
from servo_identify.learn.friction.learner_comparison import best_of, compared, markdown
from servo_rig_driver.emulated.emulated_bench import run
from servo_rig_driver.emulated.excitation_families import family
from servo_rig_driver.emulated.rig_file import load_rig
from servo_studies.papers.bench_recordings import Part, recorded
from servo_studies.papers.geared_dc import comparison_rows, page
from servo_studies.papers.geared_dc.geared_dc_results import (
    balance_figures,
    FREE,
    friction_data,
    learner_figures,
    plan,
    twin_figures,
)
from servo_studies.papers.paper_systems import SYSTEMS
from servo_twin.commands import run as bring_up
from servo_twin.description import servo_file
from servo_twin.recording.recording import Recording

CONFIG = Path(__file__).parents[2] / 'config'
RIG = CONFIG / 'rigs/dc_gearmotor.yaml'
SERVO = servo_file.load(CONFIG / 'servos/dc_gearmotor.yaml')


def played(amplitude: float, seed: int) -> Recording:
    """Record 9 s of steps on the emulated motor."""
    one, = PROCEDURES['multilevel_steps'].runs(Choices(duration=9.0, amplitudes=(amplitude,)))
    columns = run(load_rig(RIG), one.mode, one.reference, seed=seed)
    del columns['t']
    return Recording(one.name, one.period, columns, one.family)


@pytest.fixture(scope='module')
def recordings():
    """Two to train on, one unseen, one unseen and faster."""
    made = [played(u, k) for k, u in enumerate((4.0, 8.0, 6.0, 11.0))]
    return {'training': made[:2], 'unseen': made[2:3], 'faster': made[3:]}


@pytest.fixture(scope='module')
def data(recordings):
    """Friction of the recordings, the current among the features."""
    return friction_data(SERVO, recordings)


def test_multilevel_steps_visit_every_level_before_one_comes_again():
    t = np.arange(9000) * 1e-3
    reference, external = family('multilevel_steps').waves(t, {'amplitude': 8.0, 'levels': 9,
                                                               'dwell': 0.5})
    held = reference.reshape(-1, 500)
    assert (held == held[:, :1]).all() and not external.any()
    assert sorted(held[:9, 0]) == list(np.linspace(-8.0, 8.0, 9)) == sorted(held[9:, 0])
    other, _ = family('multilevel_steps').waves(t, {'amplitude': 8.0, 'order': 2})
    assert (other != reference).any()


def test_sinusoids_grow_and_never_jump():
    t = np.arange(50_000) * 1e-3
    wave, _ = family('sinusoids').waves(t, {'amplitude': 5.0, 'first': 0.2, 'last': 2.0})
    peaks = [np.abs(wave[k * 5000:(k + 1) * 5000]).max() for k in range(5)]
    assert peaks == pytest.approx([1.0, 2.0, 3.0, 4.0, 5.0], rel=2e-3)
    inside = np.arange(1, 50_000) % 5000 != 0
    assert np.abs(np.diff(wave))[inside].max() <= 5.0 * 2.0 * np.pi * 2.0 * 1e-3


def test_the_procedures_of_paper_003_give_each_amplitude_an_order_of_its_own():
    steps = PROCEDURES['multilevel_steps'].runs(Choices(amplitudes=(4.0, 8.0)))
    assert [r.mode for r in steps] == ['voltage', 'voltage']
    assert [np.abs(r.reference).max() for r in steps] == [4.0, 8.0]
    assert (2.0 * steps[0].reference != steps[1].reference).any()
    sines, = PROCEDURES['sinusoids'].runs(Choices(amplitudes=(5.0,), frequencies=(0.5,)))
    assert 4.9 < np.abs(sines.reference).max() <= 5.0 and '0.5-2Hz' in sines.name


def test_the_unseen_recordings_are_others_than_those_trained_on():
    parts = {part.name: {r.reference.tobytes() for r in part.runs} for part in plan()}
    assert not parts['training'] & (parts['unseen'] | parts['faster'])
    assert [part.trains for part in plan()] == [True, False, False]


def test_the_driver_takes_the_limits_that_stand_beside_the_rig_file():
    assert bring_up._driver_of(RIG) == CONFIG / 'drivers/dc_gearmotor.yaml'
    assert bring_up._driver_of(CONFIG / 'rigs/rv_bench.yaml').name == 'driver.yaml'


def test_an_unseen_recording_is_in_no_other_part(data):
    new = data.run >= 2
    assert not new[np.concatenate([data.train, data.validation, data.test])].any()
    assert new[data.unseen].all() and new[data.beyond].all() and len(data.beyond) > 20
    assert len(data.unseen) + len(data.beyond) == new.sum() - 2 * (SEQUENCE - 1)
    trained = np.abs(data.features[~new, 0]).max()
    assert np.abs(data.features[data.unseen, 0]).max() <= trained
    assert np.abs(data.features[data.beyond, 0]).min() > trained


def test_friction_by_equation_4_is_a_sum_of_two_features_until_one_is_left_out(data, recordings):
    def least(one) -> float:
        held = one.features[one.train]
        left = one.target[one.train] - held @ np.linalg.lstsq(held, one.target[one.train])[0]
        return float(np.std(left) / np.std(one.target[one.train]))

    blind = friction_data(SERVO, recordings, ('current',))
    assert least(data) < 1e-9 and least(blind) > 0.1
    assert np.array_equal(blind.target, data.target) and not blind.features[:, 2].any()
    with pytest.raises(ValueError, match="no feature 'voltage'; there are"):
        dataset_of(friction_of(SERVO, recordings['training']), without=('voltage',))
    with pytest.raises(ValueError, match='none to train on'):
        dataset_of(friction_of(SERVO, recordings['training']), unseen=(0, 1))


@pytest.mark.long
@pytest.mark.slow
def test_every_kind_of_learner_is_judged_on_the_unseen_recording(data):
    rows, _ = compared(data, ['coulomb_viscous', 'dahl', 'sindy', 'feedforward'], seconds=1.0)
    unseen = {row.name: row.unseen.r2 for row in rows}
    assert unseen['sindy'] > 0.9999 and unseen['dahl'] > unseen['coulomb_viscous'] > 0.5
    assert best_of(rows).name == 'sindy'
    assert markdown(rows).splitlines()[0].count('unseen') == 3


def test_friction_by_voltage_is_near_that_by_current(recordings):
    found = balance_figures(SERVO, recordings['unseen'])
    assert 0.0 < found['rms'] < 0.4 * found['spread']


def test_a_rig_without_a_load_encoder_is_fitted_and_runs_free(recordings, tmp_path):
    made = {'training': recordings['training'], 'unseen': recordings['unseen'] * 6}
    found = twin_figures(SERVO, SERVO, made, tmp_path, tmp_path)
    fits = found['fit']
    assert 0.8 < fits['data sheet'][0] < fits['fitted'][0] < 1.0
    assert found['values']['drive.resistance'][1] == pytest.approx(2.3, rel=0.04)
    assert servo_file.load(tmp_path / 'dc_gearmotor_fitted.yaml').name == 'dc_gearmotor'
    assert (tmp_path / 'geared_dc_twin.png').stat().st_size > 10_000
    run_, = free_runs(SERVO, recordings['unseen'])
    assert np.isfinite([run_.speed_fit, run_.angle_fit]).all() and set(FREE) <= set(SERVO.values)


@pytest.mark.long
def test_the_page_and_the_rows_are_made_of_the_figures(data, recordings, tmp_path):
    learned = learner_figures(data, ['coulomb_viscous', 'stribeck', 'dahl', 'lugre', 'sindy',
                                     'lstm'], 0.5, tmp_path / 'x', {'steps': 2})
    assert {p.name for p in tmp_path.iterdir()} == {'x_time.png', 'x_speed.png', 'x_losses.png'}
    text = page({
        'recordings': {'training': ['a_b']}, 'duration': 36.0, 'equation_5': learned,
        'motion': learned, 'balance': {'rms': 0.01, 'spread': 0.08},
        'twin': {'names': ['a_b'], 'seconds': 2.0, 'fit': {'fitted': [0.9]},
                 'values': {'drive.resistance': [2.2, 2.3, 0.1, 'ohm']}},
        'diagnosis': {'sentence': 'It lacks it.', 'status': 'explained', 'shrink': 0.5,
                      'effects': ['dahl_friction at the load']}})
    assert '| **paper 003, LSTM** |  |  |  | **0.012** | **0.009** | **0.982** |  |' in text
    assert '| training | a b |' in text and 'shrinks by 50 %' in text and '+0.33 i' in text
    rows = comparison_rows({'equation_5': learned, 'motion': learned})
    assert [r['system'] for r in rows] == [s.name for s in SYSTEMS if s.part == 'geared_dc']


def test_bags_of_the_motor_go_through_the_command_of_the_learners(tmp_path, capsys):
    made = recorded(tmp_path, parts=[Part('p', True, tuple(PROCEDURES['multilevel_steps'].runs(
        Choices(duration=9.0, amplitudes=(5.0, 7.0)))), 1)], servo=str(
            CONFIG / 'servos/dc_gearmotor.yaml'), rig=str(RIG))
    bags = [str(tmp_path / 'p' / r.name) for r in made['p']]
    assert main(['friction', bags[0], '--unseen', bags[1], '--servo',
                 str(CONFIG / 'servos/dc_gearmotor.yaml'), '--without', 'current',
                 '--learners', 'coulomb_viscous', '-o', str(tmp_path / 'out')]) == 0
    assert 'R2 unseen' in capsys.readouterr().out
