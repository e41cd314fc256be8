"""Launch files name what is there; test_real_launch.py runs them where ROS brings launch."""

import os
from pathlib import Path
import re
import runpy
import subprocess
import sys
from unittest import mock

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
OF_ROS = ('robot_state_publisher',)
FILES = sorted(ROOT.glob('src/*/launch/*.yaml'))


def entries(path, kind):
    return [item[kind] for item in yaml.safe_load(path.read_text())['launch'] if kind in item]


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.name)
def test_it_starts_executables_that_are_installed(path):
    for node in entries(path, 'node'):
        if node['pkg'] in OF_ROS:
            continue
        assert f"'{node['exec']} = " in (ROOT / 'src' / node['pkg'] / 'setup.py').read_text()
    for program in entries(path, 'executable'):
        package, name = re.match(r'\$\(find-pkg-prefix (\w+)\)/lib/\1/(\w+) ',
                                 program['cmd']).groups()
        assert f"'{name} = " in (ROOT / 'src' / package / 'setup.py').read_text()


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.name)
def test_it_names_files_that_are_installed_and_arguments_that_it_has(path):
    text = path.read_text()
    for package, rest in re.findall(r'\$\(find-pkg-share (\w+)\)/(\S+)', text):
        folder = ROOT if rest.startswith('config') else ROOT / 'src' / package
        assert (folder / rest).is_file()
    known = {argument['name'] for argument in entries(path, 'arg')}
    assert set(re.findall(r'\$\(var (\w+)\)', text)) == known


@pytest.mark.parametrize('name', ['rig.launch.yaml', 'twin.launch.yaml'])
def test_its_processes_share_no_memory_that_a_killed_one_leaves_half_made(name):
    path = next(path for path in FILES if path.name == name)
    assert {'name': 'FASTDDS_BUILTIN_TRANSPORTS',
            'value': '$(env FASTDDS_BUILTIN_TRANSPORTS UDPv4)'} in entries(path, 'set_env')


@pytest.mark.parametrize('name, value', [('graph_listen_time', 0.5), ('enable_after_loss', True)])
def test_what_hurts_nobody_beside_an_emulated_drive_is_left_alone_beside_a_real_one(name, value):
    nodes = entries(next(path for path in FILES if path.name == 'rig.launch.yaml'), 'node')
    given = {('if' in node): [one['value'] for one in node['param'] if one.get('name') == name]
             for node in nodes}
    assert given == {True: [value], False: []}


@pytest.fixture
def joints_file(monkeypatch):
    """Give the launch file of a list of joints, with stand-ins where ROS's launch is missing."""
    for name in ('launch', 'launch.actions', 'launch.substitutions', 'launch_ros',
                 'launch_ros.actions', 'launch_ros.parameter_descriptions'):
        monkeypatch.setitem(sys.modules, name, mock.MagicMock())
    return runpy.run_path(str(ROOT / 'src/servo_twin/launch/joints.launch.py'))


@pytest.mark.parametrize('listed', [
    '[hip, knee]', '[hip,knee]', 'hip,knee', 'hip knee', '["hip", "knee"]', "['hip', 'knee']",
    ' hip, knee ', "'hip,knee'"])
def test_joints_are_listed_as_people_type_them(joints_file, listed):
    assert joints_file['spaces'](listed) == {'hip': 'hip', 'knee': 'knee'}


def test_joints_of_any_name_have_a_namespace_that_ros_takes(joints_file):
    assert joints_file['spaces']('[on, 1, left-hip, arm/elbow.roll]') == {
        'on': 'on', '1': 'joint_1', 'left-hip': 'left_hip', 'arm/elbow.roll': 'arm_elbow_roll'}


@pytest.mark.parametrize('listed', ['', '[]', 'hip, hip', 'a-b, a_b'])
def test_joints_that_would_share_a_namespace_are_refused(joints_file, listed):
    with pytest.raises(ValueError, match='is no list of different names, such as'):
        joints_file['spaces'](listed)


def test_a_rate_that_is_no_number_is_refused_in_a_sentence(joints_file):
    given = {'joints': 'hip', 'rate': '500Hz'}
    joints_file['start'].__globals__['LaunchConfiguration'] = lambda name: mock.Mock(
        perform=lambda context: given.get(name, ''))
    with pytest.raises(ValueError, match="rate = '500Hz' is no number; give Hz, such as 500"):
        joints_file['start'](None)


@pytest.mark.parametrize(('given', 'is_so'), [({}, 'UDPv4'), (
    {'FASTDDS_BUILTIN_TRANSPORTS': 'DEFAULT'}, 'DEFAULT')])
def test_the_workspace_has_the_same_transport_unless_one_is_given(given, is_so):
    rest = {name: value for name, value in os.environ.items()
            if name != 'FASTDDS_BUILTIN_TRANSPORTS'}
    told = subprocess.run(['bash', '-c', '. ./env.sh && echo "$FASTDDS_BUILTIN_TRANSPORTS"'],
                          cwd=ROOT, env=rest | given, capture_output=True, text=True, check=True)
    assert told.stdout.strip() == is_so


def test_an_included_file_has_the_arguments_it_is_given():
    rig = next(path for path in FILES if path.name == 'rig.launch.yaml')
    known = {argument['name'] for argument in entries(rig, 'arg')}
    given = {argument['name'] for path in FILES for include in entries(path, 'include')
             for argument in include['arg']}
    assert given <= known


def test_the_file_for_the_aggregator_groups_what_every_node_says():
    told = yaml.safe_load((ROOT / 'config/diagnostics.yaml').read_text())
    group = told['analyzers']['ros__parameters']['rig']['analyzers']
    begins = {entry['startswith'][0] for entry in group.values()}
    assert begins == {f'/rig/{node}: ' for node in (
        'driver', 'adapter', 'twin', 'identify', 'recorder', 'player')}
    for entry in group.values():
        assert entry['type'] == 'diagnostic_aggregator/GenericAnalyzer' and entry['timeout'] > 1.0


def test_the_description_of_the_bench_has_the_joints_and_frames_of_the_driver():
    from xml.etree import ElementTree

    import mujoco
    file = ROOT / 'config/robots/bench.urdf'
    robot = ElementTree.parse(file).getroot()
    driver = yaml.safe_load((ROOT / 'config/driver.yaml').read_text())
    names = driver['/**/driver']['ros__parameters']['joint_names']
    assert [joint.get('name') for joint in robot.findall('joint')] == names
    links = [link.get('name') for link in robot.findall('link')]
    children = [joint.find('child').get('link') for joint in robot.findall('joint')]
    assert [link for link in links if link not in children] == ['base_link']
    assert not list(robot.iter('mesh'))
    model = mujoco.MjModel.from_xml_path(str(file))
    assert model.njnt == 2 and [model.joint(name).id for name in names] == [0, 1]
