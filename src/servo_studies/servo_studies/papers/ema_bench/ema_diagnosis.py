"""The diagnosis on the EMA bench: set as told, and set otherwise than the twin was told."""

from __future__ import annotations

from collections.abc import Sequence

from servo_identify.diagnose.diagnose import diagnose
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

CASES = (
    ('set as told', (0.010, 1.0), (0.010, 1.0)),
    ('brake of 1.5 N m, told 1 N m', (0.010, 1.5), (0.010, 1.0)),
    ('slide at 12.5 mm, told 11 mm', (0.0125, 0.0), (0.011, 0.0)),
)
"""What is shown; setting (m) and brake (N m) of the bench, and those that the twin is told."""


def diagnosed(servo: Servo, replicates: dict[tuple[float, float], Sequence[Recording]],
              told=lambda said, share: None) -> list[dict]:
    """
    Return what the diagnosis says of each case, ready for JSON.

    ``replicates``: three recordings by setting and brake, to screen, accept and report on.
    """
    found = []
    for k, (title, bench, believed) in enumerate(CASES):
        told(f'diagnosing: {title}', k / len(CASES))
        twin = servo.with_values({'effects.play.setting': believed[0],
                                  'effects.brake.asked': believed[1]})
        report = diagnose(*_parts(replicates[bench], twin)).report
        found.append({
            'title': title, 'sentence': report.verdict['sentence'],
            'where': [[w.balance, w.gap_to_noise, w.share] for w in report.where
                      if w.verdict != 'not observable'],
            'which': [[w.effect, w.site, w.shrink_realised, list(w.ambiguous_with)]
                      for w in report.which]})
    return found


def _parts(recordings: Sequence[Recording], twin: Servo):
    screen, accept, report = recordings[:3]
    return [screen], twin, [accept], [report]
