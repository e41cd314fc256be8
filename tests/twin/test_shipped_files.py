"""One rule finds the servo file that a person names, in commands, nodes, services and recorder."""

from pathlib import Path

import pytest

from servo_identify.data.named_files import files_of
from servo_rig_driver.adapter.adapter_node import mapping_of
from servo_rig_driver.can_bus.can_hub import CanHub
from servo_rig_driver.emulated.rig_file import rig_at
from servo_rig_driver.record.servo_name import servo_file as at_the_recorder
from servo_rig_driver.record.servo_name import servo_text
from servo_twin.commands.run import _rig_at
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


@pytest.mark.parametrize('take', [
    servo_file, at_the_recorder, rig_at, CanHub, lambda path: mapping_of(path, ''),
    lambda path: files_of([path]), lambda path: _rig_at(Path(path))])
def test_it_names_a_path_in_the_home_of_nobody(take):
    with pytest.raises(ValueError, match='~no_such_user/a.yaml: there is no such user; give'):
        take('~no_such_user/a.yaml')


def test_the_recorder_names_a_servo_file_that_is_no_text(tmp_path):
    (tmp_path / 'a.yaml').write_bytes(b'servo: \xff')
    with pytest.raises(ValueError, match=r'a.yaml is no text in UTF-8: .* at byte 7'):
        servo_text(str(tmp_path / 'a.yaml'))
    assert servo_text('') == ('', '')


def test_the_hub_of_a_bus_names_the_path_where_no_socket_can_be():
    with pytest.raises(OSError, match='^/proc/x: no socket can be made there, No such file'):
        CanHub('/proc/x')


def test_both_sides_find_the_same_files():
    for name in shipped_servos():
        assert at_the_recorder(name) == servo_file(name)


def test_the_service_takes_a_shipped_name():
    assert wanted('rv_plain', '').name == 'rv_plain'
