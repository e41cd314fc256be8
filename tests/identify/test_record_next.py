"""What a diagnosis asks to record next: done as it is printed, it ..."""

from pathlib import Path
import shlex

import pytest

from servo_identify.cli import main
from servo_identify.data.reading import read_recordings
from servo_identify.diagnose.answer.experiments import _other, _told
from servo_identify.diagnose.diagnose import diagnose
from servo_identify.experiment.next_command import next_command
from servo_twin.description.servo_file import load
from servo_twin.description.shipped import servo_at

SERVO = servo_at('rv_plain')
RIG = ['--headless', '--servo', 'rv_plain', '--rig', 'rv_plain', '--set', 'withheld.gravity=4']


@pytest.mark.long
@pytest.mark.slow
def test_it_resolves_what_the_first_recordings_left_open(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # a swing of some degrees does not tell a weight from a torque that is always there
    assert main(['experiment', 'velocity_loop', *RIG, '--replicates', '3', '--duration', '6', '-o',
                 'first', '--quiet']) == 0
    servo, given = load(SERVO), read_recordings(['first/*'], SERVO)
    first = diagnose(given, servo)
    one, = first.report.which
    assert {one.effect, *one.ambiguous_with} >= {'gravity', 'constant_torque'}
    asked = first.report.next_experiment
    # a spring does as a weight within reach: no recording is asked for to tell these two
    assert set(asked['separates']) == {'gravity', 'constant_torque'}

    program, *words = shlex.split(next_command(asked, servo, Path(SERVO), given))
    assert program == 'servo-identify' and main([*words, '--quiet']) == 0
    again = diagnose([*given, *read_recordings(['next/*'], SERVO)], servo)
    one, = again.report.which
    assert one.effect == 'gravity'  # a spring does the same over so short a travel
    assert not {*one.ambiguous_with} - {'spring_load'}

    # it would not ask for that recording once more, to tell the same two twins apart
    found = first.evidence.named[0]
    rival = next(one for one in found.rivals if one.mechanism.name in asked['separates'])
    twins = first.evidence.handover.patch, _other(first.evidence, found, rival)
    told = {evidence: max((new for new, family, *_ in _told(of.evidence, twins, {})
                           if family == asked['family']), default=0.0)
            for evidence, of in (('before', first), ('after', again))}
    assert told['after'] < 1.0 < told['before']
