"""The row of figures 6 and 7 of paper 004: linear form, equations by hand, response of a rig."""

import numpy as np
import pytest

from servo_studies.papers.linear_forms import (
    beside_equations,
    beside_rig,
    BIAS,
    comparison_rows,
    OUTPUT,
    response_of,
    state_space,
    tones,
    transfer_function,
    turns,
)
from servo_studies.papers.paper_systems import SYSTEMS
from servo_studies.papers.step_time import driven
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.linear.operating_point import usual_point
from servo_twin.linear.state_space import linearise
from servo_twin.physics.harmonic_drive_models import with_harmonic_drive
from servo_twin.physics.simulate import initial_state, simulate
from servo_twin.recording.recording import Recording

SERVO = with_harmonic_drive(servo_file.load(servo_at('pan_tilt_azimuth')), None)
STIFF = SERVO.with_values({
    'mechanism.stiffness': 1.21 * SERVO.values['mechanism.stiffness']})


@pytest.fixture(scope='module')
def form():
    return linearise(SERVO, 'voltage', (OUTPUT,), usual_point(SERVO))


@pytest.fixture(scope='module')
def response():
    """The response of a rig that is the servo itself, a tenth stiffer in frequency."""
    run = tones()
    voltage = run.reference - BIAS  # nothing rubs in it: a bias would drive it into its limits
    y = simulate(STIFF, driven(voltage=voltage), run.period, initial_state(STIFF))
    return response_of(Recording('made', run.period, {
        'voltage': voltage, 'motor_position': y[:, 0], 'load_position': y[:, 1]}))


def test_transfer_function_and_state_space_by_hand_are_one_system():
    above, below = transfer_function(SERVO)
    s = 2j * np.pi * np.geomspace(0.01, 1000.0, 30)
    assert state_space(SERVO)(s) == pytest.approx(above(s) / below(s), rel=1e-9)


def test_the_linear_form_is_that_of_its_equations_and_not_of_others(form):
    same, other = (beside_equations(form, servo) for servo in (SERVO, STIFF))
    assert max(same.values()) < 1e-4
    assert other['matrices'] == pytest.approx(1.0 - 1.0 / 1.21, rel=1e-3)
    assert other['poles'] > 0.05 and other['gain'] < 1e-4


def test_tones_come_round_within_the_range_of_the_command_and_never_turn_it_back():
    run = tones()
    assert len(turns()) > 40 and -1e-9 < run.reference.min() and run.reference.max() < 10.0
    rounds = run.reference.reshape(-1, 4000)
    assert np.abs(rounds - rounds[0]).max() < 1e-9


def test_a_stiffer_rig_is_seen_to_resonate_higher(form, response):
    found = beside_rig(form, response)
    ours, theirs = found['resonance']
    assert theirs / ours == pytest.approx(1.1, rel=0.03)
    assert found['size'] < 0.3 < 1.0 < found['worst'] and 30.0 < found['at'] < 60.0
    assert found['tones'][0] > 40 and found['band'][1] == 80.0


def test_the_row_says_what_was_measured(form, response):
    row, = comparison_rows({'by_hand': beside_equations(form, SERVO),
                            'rig': beside_rig(form, response)})
    assert row['system'] in {s.name for s in SYSTEMS if s.part == 'linear_forms'}
    for said in ('resonance 42.1 Hz, rig 4', f' of {len(turns())} tones that are coherent'):
        assert said in row['ours']
