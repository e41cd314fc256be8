"""
The job that diagnoses the gap: `python -m servo_identify.jobs.live.diagnose_job SERVO DIR BAG...`.

It reads and writes what `servo-identify diagnose` does, and reports how far it is. With
`--stretch FROM TO`, in s, it takes that of each recording.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys

from servo_twin.description import servo_file

from ...data.reading import read_looked_at
from ...data.stretch import ALL, Stretch
from ...diagnose.diagnose import diagnose
from ...diagnose.diagnosis_files import write_diagnosis
from ...diagnose.stages import STAGES
from .job_process import refused, report


def main(arguments: list[str]) -> int:
    """Diagnose; where that cannot be, tell why, with status 2."""
    parser = argparse.ArgumentParser()
    parser.add_argument('servo')
    parser.add_argument('output', type=Path)
    parser.add_argument('bags', nargs='+')
    parser.add_argument('--stretch', nargs=2, type=float, default=ALL)
    given = parser.parse_args(arguments)
    try:
        servo = servo_file.load(given.servo)
        given.output.mkdir(parents=True, exist_ok=True)
        _told('reading', 0.0)
        recordings = read_looked_at(given.bags, given.servo, stretch=Stretch(*given.stretch))
        found = diagnose(recordings, servo, tick=_told)
        write_diagnosis(found, Path(given.servo).read_text(), servo, given.output)
    except (ValueError, OSError) as problem:
        return refused(problem)
    report(stage='done', progress=1.0)
    return 0


def _told(stage: str, share: float) -> None:
    report(stage=stage, progress=(STAGES.index(stage) + share) / len(STAGES))


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
