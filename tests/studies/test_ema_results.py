"""The figures of the EMA bench: identification, errors as the paper counts them, page."""

from pathlib import Path

import numpy as np
import pytest

from servo_rig_driver.emulated.emulated_bench import run
from servo_rig_driver.emulated.rig_file import load_rig
from servo_studies.papers.ema_bench import comparison_rows, page
from servo_studies.papers.ema_bench.ema_errors import Apart, judged
from servo_studies.papers.ema_bench.ema_model import Conditions, identified
from servo_studies.papers.ema_bench.ema_recordings import (
    BRAKES,
    Case,
    CURVE,
    curve,
    grid,
    learned,
    SETTINGS,
)
from servo_studies.papers.paper_systems import SYSTEMS
from servo_twin.description import servo_file
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS
from servo_twin.recording.recording import COLUMNS, Recording

CONFIG = Path(__file__).parents[2] / 'config'
SERVO = servo_file.load(CONFIG / 'servos' / 'ema_bench.yaml')
WIDTHS = {'effects.play.settings': (0.0100, 0.0140), 'effects.play.widths': (0.0112, 0.0885)}


def of_rig(case, **turned):
    rig = load_rig(CONFIG / 'rigs' / 'ema_bench.yaml', case.turned).with_values(turned)
    columns = run(rig, 'position', case.run.reference, seed=case.seed)
    return Recording(case.name, 1e-3, {
        name: columns[name] for name in COLUMNS if name in columns})


def of_twin(case, servo):
    columns = {name: np.full(len(case.run.reference), np.nan) for name in INPUTS}
    columns['reference_position'] = case.run.reference
    variant = case.of(servo)
    y = simulate(variant, inputs_of(columns), 1e-3, initial_state(variant, 0.0, 0.0),
                 'closed_loop')
    return Recording(case.name, 1e-3, {
        'reference_position': case.run.reference, 'motor_position': y[:, 0],
        'load_position': y[:, 1], 'current': y[:, 3]})


def test_the_grid_shares_neither_settings_nor_set_points_with_what_is_learned_from():
    judged_on = grid()
    assert len(judged_on) == len(SETTINGS) * len(BRAKES)
    assert not set(SETTINGS) & (set(CURVE) | {case.setting for case in learned()})
    waves = {case.run.reference.tobytes() for case in [*curve(), *learned()]}
    assert not waves & {case.run.reference.tobytes() for case in judged_on}
    assert not {c.seed for c in judged_on} & {c.seed for c in grid(replicate=1)}


def test_the_standard_error_is_that_of_the_papers_formula():
    bench, model = np.array([1.0, 2.0, 4.0, 3.0]), np.array([1.5, 1.5, 4.0, 2.0])
    mse = float(np.mean((bench - model) ** 2))
    one = Apart(4, mse, bench.std(), 0.0)
    variance = np.sum((bench - model) ** 2) / (4 - 1)  # s^2, the corrected variance
    assert one.se == pytest.approx(100.0 * np.sqrt(variance / 4) / bench.std())
    assert one.rmse == pytest.approx(one.se * np.sqrt(4 - 1))


def test_a_model_judged_on_its_own_recording_makes_no_error_and_is_a_thousand_times_faster():
    servo = SERVO.with_values(WIDTHS)
    case = Case('own', 0.012, 1.0, 0.5, 0.2, 1, phase=0.1, duration=10.0)
    one = judged(servo, case, of_twin(case, servo), [of_twin(case, servo)])
    assert all(a.rmse < 1e-3 and a.floor == 0.0 for a in one.signals.values())
    assert one.late == 0.0 and one.ratio < 1e-3
    assert np.abs(one.command_error).max() < 1e-6


def test_where_in_its_gap_the_mesh_begins_is_found():
    servo = SERVO.with_values(WIDTHS)
    case = Case('shifted', 0.012, 0.5, 0.5, 0.2, 1, duration=10.0)
    recording = of_twin(case, servo)
    recording['motor_position'][:] += 124.0 * 0.01  # an encoder whose zero is elsewhere
    conditions = Conditions(case, recording)
    assert conditions.command.amplitude == pytest.approx(0.5)
    y = conditions.rolled(case.of(servo))
    assert y[0, 0] == pytest.approx(124.0 * 0.01)


def test_the_brake_of_the_rig_is_identified_at_settings_that_differ():
    cases = [Case(f'c{k}', s, b, 0.5, f, 10 + k, duration=8.0)
             for k, (s, b, f) in enumerate(((0.010, 1.5, 0.25), (0.014, 0.5, 0.2)))]
    quiet = {'brake.swing': 0.0, 'motor.cogging': 0.0}
    servo, std = identified(SERVO.with_values(WIDTHS), cases, [of_rig(c, **quiet) for c in cases])
    value = servo.values
    # the rig's disc runs out by 3 % at 0.8 rad and its mean is what was asked
    assert value['effects.brake.gain'] == pytest.approx(0.0, abs=0.015)
    assert np.hypot(value['effects.brake.cosine'], value['effects.brake.sine']) == pytest.approx(
        0.03, abs=0.006)
    assert np.arctan2(-value['effects.brake.sine'], value['effects.brake.cosine']) == (
        pytest.approx(0.8, abs=0.25))
    assert value['mechanism.rotor_inertia'] == pytest.approx(1.2e-3, rel=0.05)
    assert all(0.0 < std[f'effects.brake.{n}'] < 0.01 for n in ('gain', 'cosine', 'sine'))


def figures():
    """Return figures as the part keeps them, of one case; numbers that are easy to find again."""
    signals = {name: {'n': 1000, 'mse': 1e-6, 'se': se, 'rmse': 31.6 * se, 'floor': 0.123,
                      'signal': 1.0}
               for name, se in (('position', 0.001), ('speed', 0.03), ('current', 0.1))}
    case = {'setting': 0.011, 'brake': 1.5, 'phase': 0.1, 'ratio': 2e-4, 'wall': 3e-4,
            'late': 0.012, 'frequency_error': 1e-7, 'phase_error': -2e-6, 'response_error': 3e-4,
            'signals': signals}
    play = {'setting': 0.0103, 'width': 0.0171, 'std': 1e-4, 'varies': 4e-4, 'wound': 2e-4,
            'drawn': 0.0113}
    return {'grid': [case], 'play': [play], 'turn': {'cosine': 0.1, 'sine': -0.2},
            'learned': [[0.0105, 1.8, 0.6, 0.07]], 'played': [[0.5, 0.1, 20.0], [0.6, 0.08, 25.0]],
            'identified': [['effects.brake.gain', 0.0, 0.01, 1e-3, '']], 'step': 2.5e-4,
            'diagnosed': [{'title': 'told otherwise', 'sentence': 'It is the mesh.',
                           'where': [['torque', 2.0, 0.1], ['transmission', 9.0, 0.9]],
                           'which': [['backlash', 'mesh', 0.8, ['hysteresis']]]}]}


def test_the_page_tells_what_was_missed_and_rows_are_those_of_the_comparison():
    text = page(figures())
    assert "speed is beyond the paper's" in text and '0.03 %' in text
    assert 'transmission, 90 % of the gap' in text and 'backlash (80 %) or hysteresis' in text
    assert '17.10' in text and '+51 %' in text  # the backlash, and what the drawing is off by
    rows = comparison_rows(figures())
    assert {row['system'] for row in rows} == {s.name for s in SYSTEMS if s.part == 'ema_bench'}
    assert all(isinstance(text, str) for row in rows for text in row.values())
