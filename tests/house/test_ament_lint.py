"""ROS's own linters over the packages, where they are installed; package.xml is judged always."""

from pathlib import Path
import subprocess
import sys

from catkin_pkg.package import parse_package
import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = sorted(path.parent for path in (ROOT / 'src').glob('*/package.xml'))
IGNORED = ('D100', 'D101', 'D102', 'D103', 'D104', 'D105', 'D106', 'D107', 'D203', 'D212', 'D404',
           'D301', 'D401')
"""Those of ament, and the two that tools/ament_flake8.ini gives reasons for."""


@pytest.mark.parametrize('package', PACKAGES, ids=lambda path: path.name)
def test_its_package_xml_is_valid(package):
    warnings = []
    parse_package(str(package), warnings=warnings).validate(warnings=warnings)
    assert warnings == []


def run(module, *arguments):
    ended = subprocess.run([sys.executable, '-m', module, *arguments], cwd=ROOT, text=True,
                           capture_output=True)
    assert ended.returncode == 0, ended.stdout[-3000:] + ended.stderr[-1000:]


@pytest.mark.slow
def test_flake8_as_ament_configures_it_finds_nothing():
    for needed in ('flake8', 'flake8_docstrings', 'flake8_quotes', 'flake8_builtins'):
        pytest.importorskip(needed, reason=f'ament_flake8 needs {needed}: it comes with ROS')
    run('flake8', '--config', 'tools/ament_flake8.ini', 'src')


@pytest.mark.slow
def test_pep257_as_ament_configures_it_finds_nothing():
    pytest.importorskip('pydocstyle', reason='ament_pep257 needs pydocstyle: it comes with ROS')
    run('pydocstyle', f'--ignore={",".join(IGNORED)}', 'src')
