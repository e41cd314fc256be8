"""Who may know whom, checked on every module of the workspace."""

import importlib.util
from pathlib import Path
import subprocess
import sys

from import_rules import imports_of, modules, violations
import pytest

SRC = Path(__file__).resolve().parents[2] / 'src'


def test_it_breaks_no_rule():
    assert violations(SRC) == []


def test_it_walks_every_package():
    assert {name.split('.')[0] for name, _ in modules(SRC)} == {
        'servo_rig_driver', 'servo_twin', 'servo_identify', 'servo_studies'}


def test_the_layers_of_the_packages_hold():
    # in a process of its own: it silences every logger that there is
    linted = subprocess.run(['lint-imports', '--config', str(SRC.parent / 'pyproject.toml'),
                             '--no-cache'], capture_output=True, text=True, cwd=SRC.parent)
    assert linted.returncode == 0, linted.stdout


def _plant(src: Path, module: str, text: str) -> None:
    path = src / module.split('.')[0] / Path(*module.split('.')).with_suffix('.py')
    path.parent.mkdir(parents=True)
    path.write_text(text)


@pytest.mark.parametrize(('module', 'text'), [
    ('servo_twin.physics.law', 'import yaml'),
    ('servo_twin.physics.law', 'import time'),
    ('servo_twin.physics.law', 'import rclpy.clock'),
    ('servo_twin.physics.effects.law', 'from ...bag import reading'),
    ('servo_twin.physics.law', 'from .. import servo_file'),
    ('servo_twin.physics.law', 'def late():\n    from servo_twin.lockstep.twin import Twin'),
    ('servo_twin.cli', 'import importlib\nimportlib.import_module("servo_identify.cli")'),
    ('servo_identify.training', 'import torch'),
    ('servo_identify.fit', 'def late():\n    import torch.nn'),
    ('servo_twin.lockstep.twin', 'from servo_twin_msgs.msg import Encoder'),
])
def test_it_catches_a_planted_violation(tmp_path, module, text):
    _plant(tmp_path, module, text)
    (sentence,) = violations(tmp_path)
    assert sentence.startswith(f'{module}:')


@pytest.mark.parametrize(('module', 'text'), [
    ('servo_twin.physics.effects.law', 'from math import exp\nfrom ..ports import Friction'),
    ('servo_twin.physics.kernel', 'import hashlib\nimport numba\nfrom dataclasses import field'),
    ('servo_identify.training', 'def fit():\n    import torch'),
    ('servo_identify.fit', 'from servo_twin.physics import effect'),
    ('servo_twin.nodes.twin_node', 'import rclpy\nfrom servo_twin_msgs.msg import Residual'),
    ('servo_twin.bag.bag_writing', 'from servo_twin_msgs.msg import Encoder'),
    ('servo_twin.nodes.message_conversion', 'from servo_twin_msgs import msg'),
])
def test_it_lets_pass_what_is_allowed(tmp_path, module, text):
    _plant(tmp_path, module, text)
    assert violations(tmp_path) == []


def test_it_resolves_relative_imports(tmp_path):
    _plant(tmp_path, 'servo_twin.physics.effects.law', 'from ..ports import Friction')
    ((module, path),) = modules(tmp_path)
    (found,) = imports_of(module, path)
    assert found.name == 'servo_twin.physics.ports.Friction'


def test_it_loads_neither_ros_nor_file_formats_with_physics():
    if importlib.util.find_spec('servo_twin.physics') is None:
        pytest.fail('servo_twin.physics cannot be found: source env.sh first')
    program = ('import sys, servo_twin.physics\n'
               'print(*(m for m in ("rclpy", "servo_twin_msgs", "torch", "rosbags") '
               'if m in sys.modules))')
    answer = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                            check=True)
    assert answer.stdout.split() == []
