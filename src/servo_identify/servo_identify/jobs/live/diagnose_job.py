"""
The job that diagnoses the gap: `python -m servo_identify.jobs.live.diagnose_job SERVO DIR BAG...`.

It writes what `servo-identify diagnose` writes, and reports how far it is.
"""

from __future__ import annotations

from pathlib import Path
import sys

from servo_twin.bag import read_recording
from servo_twin.description import servo_file

from ...diagnose.diagnose import diagnose
from ...diagnose.diagnosis_files import write_diagnosis
from ...diagnose.stages import STAGES
from .job_process import refused, report


def main(arguments: list[str]) -> int:
    """Diagnose; where that cannot be, tell why, with status 2."""
    path, folder, *bags = arguments
    output = Path(folder)
    try:
        servo = servo_file.load(path)
        output.mkdir(parents=True, exist_ok=True)
        _told('reading', 0.0)
        found = diagnose([read_recording(bag) for bag in bags], servo, tick=_told)
        write_diagnosis(found, Path(path).read_text(), servo, output)
    except (ValueError, OSError) as problem:
        return refused(problem)
    report(stage='done', progress=1.0)
    return 0


def _told(stage: str, share: float) -> None:
    report(stage=stage, progress=(STAGES.index(stage) + share) / len(STAGES))


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
