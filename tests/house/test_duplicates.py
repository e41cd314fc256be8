"""Code is written once: what stands twice is known, and says why."""

from pathlib import Path
import re
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
LINES = 8  # alike and in a row, from which a pair counts; comments and docstrings do not
MOST = 23  # pairs of six lines to the letter that the tool `duplicates` may find, where it is
IMPORTS = 'mechanisms import the same places of the state'
APART = 'rig and twin import nothing of each other'
KNOWN = {
    ('servo_rig_driver/ending.py', 'nodes/ending.py'): APART,
    ('servo_rig_driver/free_output.py', 'nodes/free_output.py'): APART,
    ('servo_rig_driver/given_parameters.py', 'nodes/given_parameters.py'): APART,
    ('servo_rig_driver/managed_node.py', 'nodes/managed_node.py'): APART,
    ('record/mixed_topics.py', 'nodes/mixed_topics.py'): APART,
    ('servo_rig_driver/namesake.py', 'nodes/namesake.py'): APART,
    ('servo_rig_driver/ros_start.py', 'nodes/ros_start.py'): APART,
    ('servo_identify/setup.py', 'servo_twin/setup.py'): 'each package is built by itself',
    ('feed_drive/feed_sampling.py', 'emulated/rig_sampling.py'):
        'a compiled function that is handed on would be compiled again in each process',
    ('mechanisms/rigid.py', 'mechanisms/two_inertia.py'): IMPORTS,
    ('mechanisms/ball_screw.py', 'mechanisms/fmu.py'): IMPORTS,
    ('mechanisms/ball_screw.py', 'mechanisms/rigid.py'): IMPORTS,
    ('mechanisms/fmu.py', 'mechanisms/two_inertia.py'): IMPORTS,
}
"""Pairs of files that have LINES in common, and why."""


def test_nothing_stands_twice_that_is_not_known():
    files = sorted(str(path) for part in ('src', 'tests', 'tools')
                   for path in (ROOT / part).rglob('*.py'))
    told = subprocess.run(
        [sys.executable, '-c', 'from pylint.checkers.symilar import Run; Run()',
         f'--duplicates={LINES}', '--ignore-comments', '--ignore-docstrings', *files],
        capture_output=True, text=True, timeout=250).stdout
    assert 'TOTAL lines=' in told
    found = {tuple(re.findall(r'^==.*?([^/]+/[^/]+):\[', part, re.MULTILINE))
             for part in told.split(' similar lines in ')[1:]}
    assert found == set(KNOWN)


@pytest.mark.skipif(not shutil.which('duplicates'), reason='duplicates is not installed here')
def test_duplicates_finds_no_more_than_the_stated_number_of_pairs():
    told = subprocess.run(['duplicates', '--seconds', '120'], cwd=ROOT, capture_output=True,
                          text=True, timeout=250).stdout
    pairs, shapes = map(int, re.search(r'^(\d+) pairs .*\((\d+) by shape alone', told).groups())
    assert pairs - shapes <= MOST, told
