"""How effects are found, and what makes a new one."""

from __future__ import annotations

import every_effect
import numpy as np
import pytest

from servo_twin.description.servo_file import loads
from servo_twin.physics import catalogue
from servo_twin.physics.catalogue import find, names
from servo_twin.physics.simulate import initial_state, simulate

NEW = '''"""Friction of a seal."""

from servo_twin.physics.effect import Parameter
from servo_twin.physics.ports import Friction


class SealFriction(Friction):
    r"""
    Twice a level.

    .. math:: \\\\tau_f = 2\\\\tau_s
    """

    source = 'this test'

    level = Parameter(1.0, 'N m', (0.0, 10.0), 'Half of it.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return 2.0 * p.level
'''


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A user's folder with one effect file; what was taken in is forgotten afterwards."""
    monkeypatch.setattr(catalogue, '_FOREIGN', {})
    (tmp_path / 'seal_friction.py').write_text(NEW)
    return tmp_path


@pytest.mark.long
def test_a_new_effect_is_one_new_file(folder):
    text = ('servo: s\ndrive: {type: current, gain: 0.49, torque_constant: 0.4878}\n'
            'mechanism: {type: rigid, rotor_inertia: 1.14e-4, ratio: 1.0, load_inertia: 0.0}\n'
            'effects: {seal: {effect: {e}, at: motor, level: {l}}}')
    assert catalogue.register(folder) == ['seal_friction']
    assert 'seal_friction' in names()
    new = loads(text.replace('{e}', 'seal_friction').replace('{l}', '0.1'))
    twice = loads(text.replace('{e}', 'coulomb_friction').replace('{l}', '0.2'))
    u = every_effect.inputs(100, voltage=2.0)
    answers_of = [simulate(s, u, 1e-3, initial_state(s)) for s in (new, twice)]
    assert answers_of[0][-1, 0] > 0.0
    assert np.array_equal(*answers_of)


def test_taking_a_folder_in_twice_is_harmless(folder):
    assert catalogue.register(folder) == catalogue.register(folder)


def test_a_file_of_a_name_that_is_there_is_refused(folder):
    (folder / 'backlash.py').write_text(NEW)
    with pytest.raises(ValueError, match="an effect 'backlash' is in the catalogue already"):
        catalogue.register(folder)


def test_a_file_without_an_effect_of_its_name_is_refused(folder):
    (folder / 'seal_friction.py').rename(folder / 'other.py')
    with pytest.raises(ValueError, match="must hold an effect class whose name is 'other'"):
        catalogue.register(folder)


def test_a_file_that_does_not_run_is_refused_with_its_error(folder):
    (folder / 'seal_friction.py').write_text('x = 1 / 0')
    with pytest.raises(ValueError, match='seal_friction.py: ZeroDivisionError'):
        catalogue.register(folder)


def test_a_folder_without_effects_is_refused(tmp_path):
    with pytest.raises(ValueError, match='there is no effect file'):
        catalogue.register(tmp_path)


def test_an_unknown_effect_is_refused_with_the_names_there_are():
    with pytest.raises(KeyError, match="there is no effect 'stiction'; there are"):
        find('stiction')


def test_an_effect_is_final():
    with pytest.raises(TypeError, match='Backlash is final'):
        type('Wider', (find('backlash'),), {})
