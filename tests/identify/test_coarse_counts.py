"""A check of angles that come in coarse steps: it says when these hide effects, ..."""

from math import pi

from bench_recording import bench_recording
from checked_bench import changed, of_level
import numpy as np
import pytest

DEGREE = pi / 180.0


@pytest.fixture(scope='module')
def good():
    return bench_recording(4.0)


def stepped(recording, name, step):
    return changed(recording, **{name: step * np.round(recording[name] / step)})


def said_of(recording):
    return [one for one in of_level('amber', recording)
            if 'coarse for this motion' in one.sentence]


def test_it_names_step_and_share_of_the_torque_at_work(good):
    one, = said_of(stepped(good, 'load_position', DEGREE))
    assert 'bench: load_position comes in steps of 1 deg (360 a turn)' in one.sentence
    assert '% of the acceleration' in one.sentence and 'of that at work' in one.sentence
    assert 'more decimals' in one.action


@pytest.mark.parametrize('step', [DEGREE / 200.0, 2 * pi / 2**16])
def test_it_is_silent_of_fine_counts_and_of_none(good, step):
    assert not said_of(stepped(good, 'load_position', step)) and not said_of(good)


def hidden_twist(recording):
    return [one for one in of_level('amber', recording)
            if 'the twist between the encoders' in one.sentence]


@pytest.mark.parametrize('name, coarse, fine', [
    ('load_position', 2 * pi / 2**14, 2 * pi / 2**16), ('motor_position', 0.1, 0.05)])
def test_it_says_where_steps_hide_the_twist_alone(good, name, coarse, fine):
    """Steps that leave the acceleration as it is may be more than all twist of the shaft."""
    recording = stepped(good, name, coarse)
    one, = hidden_twist(recording)
    assert not said_of(recording)
    assert f'bench: {name} comes in steps' in one.sentence and 'backlash' in one.sentence
    assert 'mrad of it, and the torque at work twists by 0.0644 mrad' in one.sentence
    assert 'nothing smaller than that of the transmission' in one.action
    assert not hidden_twist(stepped(good, name, fine))


def test_it_weighs_the_whole_inertia_by_one_encoder(good):
    """The same steps of the motor are coarser where no encoder of the load tells its inertia."""
    alone = changed(good, load_position=np.full(len(good), np.nan))
    shares = [float(one.sentence.split('a torque of ')[1].split()[0]) for one in (
        *said_of(stepped(good, 'motor_position', 400 * DEGREE)),
        *said_of(stepped(alone, 'motor_position', 400 * DEGREE)))]
    assert len(shares) == 2 and shares[1] > shares[0]
