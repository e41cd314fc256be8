"""Published recordings of real machines; skipped where they are not beside the workspace."""

import numpy as np
import pytest

from servo_identify.cli import main
from servo_studies.real_machines import emps, two_mass, xl330


def test_emps_inverse_model_is_as_good_as_the_published_one(shared_data):
    recording = emps.recording_of(shared_data)
    symmetric = emps.inverse_model(recording, 35.15, False)
    asymmetric = emps.inverse_model(recording, 35.15, True)
    assert symmetric.percent <= 4.08 and asymmetric.percent <= 3.11
    assert symmetric.parameters == {
        'mass': pytest.approx(95.1, rel=0.01), 'viscous': pytest.approx(203.5, rel=0.02),
        'coulomb': pytest.approx(20.4, rel=0.03), 'offset': pytest.approx(-3.2, rel=0.05)}


def test_emps_in_closed_loop_finds_the_published_parameters(shared_data):
    estimate, errors = emps.closed_loop(emps.recording_of(shared_data))
    assert estimate.values['mechanism.load_inertia'] == pytest.approx(95.1, rel=0.02)
    assert estimate.values['effects.coulomb.level'] == pytest.approx(20.4, rel=0.05)
    assert estimate.values['effects.viscous.slope'] == pytest.approx(203.5, rel=0.05)
    assert estimate.values['effects.offset.difference'] == pytest.approx(-3.2, rel=0.1)
    assert errors['position_percent'] < 0.0138 and errors['force_percent'] < 6.5


@pytest.mark.slow
def test_xl330_is_predicted_better_with_friction_that_grows_with_load(shared_data):
    figures = xl330.figures(shared_data)
    plain, loaded = (figures[s]['held_out']['all'] for s in ('coulomb_viscous', 'load_dependent'))
    assert loaded < 0.075 and loaded < 0.5 * plain
    for held, errors in figures['splits'].items():
        plain, loaded = (errors[s]['all'] for s in ('coulomb_viscous', 'load_dependent'))
        assert loaded < 0.75 * plain, held
    unseen = figures['splits']['gain 100, trained on 400']
    assert unseen['load_dependent']['all'] < 0.06 < 0.1 < unseen['coulomb_viscous']['all']


@pytest.mark.long
@pytest.mark.slow
def test_two_masses_resonate_where_the_frequency_response_says(shared_data):
    figures = two_mass.figures(shared_data)
    assert figures['measured'] == (pytest.approx(53.0, abs=1.0), pytest.approx(77.0, abs=1.0))
    assert np.array(figures['fitted']) == pytest.approx(figures['measured'], rel=0.02)


def test_the_command_says_what_folder_is_missing(tmp_path, capsys):
    assert main(['results', str(tmp_path)]) == 2
    assert 'there is no such folder' in capsys.readouterr().err
