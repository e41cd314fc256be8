"""One rule finds the servo file that a person names, in commands, nodes, services and recorder."""

from pathlib import Path

import pytest

from servo_rig_driver.record.servo_name import servo_file as at_the_recorder
from servo_twin.description.shipped import servo_file, shipped_servos
from servo_twin.nodes.servo_loading import wanted
from servo_twin.physics.servo import ServoError


@pytest.mark.parametrize('find', [servo_file, at_the_recorder])
def test_it_finds_shipped_names_and_paths(find, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'rv_plain').mkdir()  # a folder of that name is no servo file
    assert find('rv_plain').name == 'rv_plain.yaml'
    own = tmp_path / 'own.yaml'
    own.write_text('')
    assert find('own.yaml') == Path('own.yaml')
    assert find(str(own)) == own


@pytest.mark.parametrize('find, error', [(servo_file, ServoError), (at_the_recorder, ValueError)])
@pytest.mark.parametrize('name', ['nowhere', 'nowhere.yaml', '/nowhere/rv_plain', ''])
def test_it_names_the_choice_where_there_is_no_such_file(find, error, name):
    with pytest.raises(error, match='nowhere|^.: cannot be read') as caught:
        find(name)
    assert 'rv_plain' in str(caught.value)


def test_both_sides_find_the_same_files():
    for name in shipped_servos():
        assert at_the_recorder(name) == servo_file(name)


def test_the_service_takes_a_shipped_name():
    assert wanted('rv_plain', '').name == 'rv_plain'
