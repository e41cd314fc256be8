"""Launch files name what is there: they cannot be run where ROS brings no launch."""

from pathlib import Path
import re

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted(ROOT.glob('src/*/launch/*.yaml'))


def entries(path, kind):
    return [item[kind] for item in yaml.safe_load(path.read_text())['launch'] if kind in item]


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.name)
def test_it_starts_executables_that_are_installed(path):
    for node in entries(path, 'node'):
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


def test_an_included_file_has_the_arguments_it_is_given():
    rig = next(path for path in FILES if path.name == 'rig.launch.yaml')
    known = {argument['name'] for argument in entries(rig, 'arg')}
    given = {argument['name'] for path in FILES for include in entries(path, 'include')
             for argument in include['arg']}
    assert given <= known
