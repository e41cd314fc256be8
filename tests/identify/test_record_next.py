"""What a diagnosis asks to record next: done as it is printed, it ..."""

import json
import shlex

import pytest

from servo_identify.cli import main

RIG = ['--headless', '--servo', 'rv_plain', '--rig', 'rv_plain', '--set', 'withheld.gravity=4']


@pytest.mark.slow
def test_it_resolves_what_the_first_recordings_left_open(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # a swing of some degrees does not tell the weight of an arm from a friction that differs by way
    assert main(['experiment', 'velocity_loop', *RIG, '--replicates', '3', '--duration', '6', '-o',
                 'first', '--quiet']) == 0
    first = diagnosed('first/*', 'answer')
    one, = first['which']
    assert {one['effect'], *one['ambiguous_with']} >= {'gravity', 'asymmetric_friction'}
    following = first['next_experiment']
    assert set(following['separates']) == {one['effect'], one['ambiguous_with'][0]}
    program, *words = shlex.split(following['command'])
    assert program == 'servo-identify' and main([*words, '--quiet']) == 0
    again = diagnosed('next/*', 'answer2', 'first/*')
    one, = again['which']
    assert (one['effect'], one['ambiguous_with']) == ('gravity', [])
    assert again['next_experiment'].get('family', '') != following['family']


def diagnosed(bags, output, *more):
    """Return the report of a diagnosis of bags."""
    assert main(['diagnose', bags, *more, '--servo', 'rv_plain', '-o', output, '--quiet',
                 '--no-page']) == 0
    with open(f'{output}/report.json') as file:
        return json.load(file)
