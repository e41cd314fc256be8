"""package.xml says what a package imports, starts and tests: rosdep can install a workspace."""

import ast
from pathlib import Path
import re
import sys
from xml.etree import ElementTree

import pytest

SOURCES = Path(__file__).resolve().parents[2] / 'src'
PACKAGES = sorted(path.parent.name for path in SOURCES.glob('*/setup.py'))
KEYS = {'can': 'python3-can', 'canopen': 'canopen-pip',
        'cantools': 'python3-cantools-pip', 'h5py': 'python3-h5py',
        'jinja2': 'python3-jinja2',
        'matplotlib': 'python3-matplotlib', 'mujoco': 'python3-mujoco-pip',
        'numba': 'python3-numba', 'numpy': 'python3-numpy', 'rich': 'python3-rich',
        'openpyxl': 'python3-openpyxl', 'pandas': 'python3-pandas',
        'rosbags': 'python3-rosbags-pip',
        'ruamel': 'python3-ruamel.yaml',
        'scipy': 'python3-scipy', 'sklearn': 'python3-sklearn',
         'torch': 'python3-torch', 'tornado': 'python3-tornado', 'xarray': 'python3-xarray',
         'yaml': 'python3-yaml'}
"""Modules and their keys in rosdep's python.yaml."""
PIP = {'backports': 'backports.zstd', 'fmpy': 'FMPy', 'mcap_protobuf': 'mcap-protobuf-support'}
"""Modules without a key whose distribution has another name; what is in neither is a package."""
BY_PIP = PIP | {'can': 'python-can', 'ruamel': 'ruamel.yaml', 'sklearn': 'scikit-learn',
                'yaml': 'pyyaml', 'fmpy': 'fmpy', 'compression': 'backports.zstd'}
"""Modules whose distribution has another name on the package index."""
BROUGHT = {'backports.zstd', 'dask', 'lz4', 'markupsafe', 'scikit-learn'}
"""What comes with something pinned: rosbags, distributed, jinja2, pysindy."""
ROS = {'ament_index_python', 'builtin_interfaces', 'diagnostic_msgs', 'lifecycle_msgs',
       'rcl_interfaces', 'rclpy', 'rosgraph_msgs', 'sensor_msgs', 'std_msgs', 'std_srvs',
       'servo_twin_msgs', *PACKAGES}
STANDARD = {*sys.stdlib_module_names, 'compression'}  # the latter from Python 3.14 on


def imported(package):
    """Return the top modules that a package imports, but those of Python and its own."""
    found = set()
    for file in (SOURCES / package / package).rglob('*.py'):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                found |= {name.name.partition('.')[0] for name in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(node.module.partition('.')[0])
    return found - STANDARD - {package}


def manifest(package):
    return SOURCES / package / 'package.xml'


def declared(package):
    return {entry.text for entry in ElementTree.parse(manifest(package)).getroot()
            if entry.tag.endswith('depend')}


def by_pip(package):
    """Return what the manifest names as installed by pip only."""
    told = re.search(r'pip installs them: (.*?) -->', manifest(package).read_text())
    return set(told.group(1).split(', ')) if told else set()


@pytest.mark.parametrize('package', PACKAGES)
def test_what_it_imports_is_declared_and_nothing_else_is_named_for_pip(package):
    modules = imported(package)
    keys = {KEYS.get(module, module) for module in modules if module in KEYS or module in ROS}
    assert keys <= declared(package)
    assert {PIP.get(module, module) for module in modules - set(KEYS) - ROS} == by_pip(package)
    assert {key for key in declared(package) if key in KEYS.values()} <= keys


@pytest.mark.parametrize('package', PACKAGES)
def test_what_its_launch_files_need_is_declared(package):
    needed = set()
    for file in (SOURCES / package / 'launch').glob('*.yaml'):
        text = file.read_text()
        needed |= {'launch', 'launch_ros', 'launch_yaml'}
        needed |= set(re.findall(r'find-pkg-(?:share|prefix) (\w+)', text))
        needed |= set(re.findall(r'pkg: (\w+)', text))
    assert needed - {package} <= declared(package)


def required(package):
    """Return the names of what pip installs with a package, and with its extras."""
    tree = ast.parse((SOURCES / package / 'setup.py').read_text())
    told = {node.targets[0].id: ast.literal_eval(node.value) for node in tree.body
            if isinstance(node, ast.Assign) and node.targets[0].id in ('REQUIRES', 'EXTRAS')}
    every = [*told['REQUIRES'], *(one for some in told.get('EXTRAS', {}).values() for one in some)]
    return {re.match(r'[\w.-]+', one)[0] for one in every}


@pytest.mark.parametrize('package', PACKAGES)
def test_pip_brings_what_it_imports_and_nothing_else(package):
    modules = imported(package)
    others = {one for one in modules if one in PACKAGES}
    assert {BY_PIP.get(module, module) for module in modules - ROS} | others == required(package)


@pytest.mark.parametrize('package', PACKAGES)
def test_what_pip_brings_is_pinned_in_requirements(package):
    pinned = {re.match(r'[\w.-]+', line)[0].lower().replace('_', '-')
              for file in (SOURCES.parent / 'requirements').glob('*.txt')
              for line in file.read_text().splitlines() if line[:1].isalpha()}
    assert required(package) - set(PACKAGES) - BROUGHT <= pinned


def test_no_package_needs_one_that_needs_it():
    needs = {package: declared(package) & set(PACKAGES) for package in PACKAGES}
    while needs:
        free = [package for package, others in needs.items() if not others & set(needs)]
        assert free, f'these need each other: {needs}'
        for package in free:
            del needs[package]


def test_maintainers_can_be_written_to():
    for package in (*PACKAGES, 'servo_twin_msgs'):
        address = ElementTree.parse(manifest(package)).getroot().find('maintainer').get('email')
        assert re.fullmatch(r'[\w.-]+@[\w-]+\.(org|dev|com|io)', address)
        if package in PACKAGES:
            assert f"'{address}'" in (SOURCES / package / 'setup.py').read_text()


def test_the_lock_holds_what_requirements_pin():
    folder = SOURCES.parent / 'requirements'
    locked = dict(re.findall(r'^([\w.-]+)(?:\[[\w,]+\])?==([^\s;\\]+)',
                             (folder / 'ros_wheels.lock').read_text(), re.MULTILINE))
    for name in ('workspace.txt', 'ros_wheels.txt'):
        for package, number in re.findall(r'^([\w.-]+)(?:\[[\w,]+\])?==(\S+)',
                                          (folder / name).read_text(), re.MULTILINE):
            held = locked.get(package.lower().replace('_', '-').replace('.', '-'))
            assert held == number, f'{package}=={number}, the lock has {held}; run make lock'


@pytest.mark.parametrize('package', PACKAGES)
def test_colcon_runs_its_tests_as_make_test_does(package):
    import configparser
    import tomllib
    here = configparser.ConfigParser()
    here.read(SOURCES / package / 'setup.cfg')
    ours = here['tool:pytest']
    root = SOURCES.parent
    everywhere = tomllib.loads((root / 'pyproject.toml').read_text())['tool']['pytest']
    everywhere = everywhere['ini_options']
    assert "'test': ['pytest']" in (SOURCES / package / 'setup.py').read_text()
    folder = (SOURCES / package / ours['testpaths']).resolve()
    assert folder == root / 'tests' / package.removeprefix('servo_')
    assert list(folder.glob('test_*.py'))
    assert [(SOURCES / package / path).resolve() for path in ours['pythonpath'].split()] == [
        root / path for path in everywhere['pythonpath']]
    assert ours['addopts'] == everywhere['addopts']
    assert [line.partition(':')[0] for line in ours['markers'].strip().splitlines()] == [
        line.partition(':')[0] for line in everywhere['markers']]


def test_every_package_and_the_citation_say_the_version_of_the_changelog():
    root = SOURCES.parent
    changes = (root / 'CHANGELOG.md').read_text()
    newest = re.search(r'^## (\d+\.\d+\.\d+)', changes, re.MULTILINE)[1]
    told = {package: ElementTree.parse(manifest(package)).getroot().findtext('version')
            for package in (*PACKAGES, 'servo_twin_msgs')}
    told['CITATION.cff'] = re.search(r'^version: (.+)$', (root / 'CITATION.cff').read_text(),
                                     re.MULTILINE)[1]
    assert set(told.values()) == {newest}, told
    assert not [package for package in PACKAGES
                if "version='" in (SOURCES / package / 'setup.py').read_text()]
