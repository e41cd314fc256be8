"""
The job that diagnoses the gap: `python -m servo_identify.serving.diagnosing SERVO DIR BAG...`.

It writes what `servo-identify diagnose` writes, and reports how far it is. The last minutes of a
running rig begin in the middle of its motion, where the integral of its controller is not known;
such a recording is therefore not asked about the controller.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import sys

import numpy as np

from servo_twin import servo_file
from servo_twin.bag import read_recording
from servo_twin.recording import Recording

from ..gap.diagnose import diagnose, STAGES
from ..gap.page import write_page
from .job import report
from .ring import RUNNING


def main(arguments: list[str]) -> int:
    """Diagnose; what is wrong is the last line, with status 2."""
    path, folder, *bags = arguments
    output = Path(folder)
    try:
        servo = servo_file.load(path)
        output.mkdir(parents=True, exist_ok=True)
        _told('reading', 0.0)
        found = diagnose([_asked(read_recording(bag)) for bag in bags], servo, tick=_told)
        found.report.save(output / 'report.json')
        servo_file.save(found.augmented, output / 'augmented.yaml')
        write_page(found, output / 'report.html')
    except (ValueError, OSError) as problem:
        print(problem, flush=True)
        return 2
    report(stage='done', progress=1.0)
    return 0


def _asked(recording: Recording) -> Recording:
    """Return the recording without references where it began while the rig was running."""
    if recording.family != RUNNING:
        return recording
    unknown = np.full(len(recording), np.nan)
    return replace(recording, columns={**recording.columns, 'reference_velocity': unknown,
                                       'reference_position': unknown})


def _told(stage: str, share: float) -> None:
    report(stage=stage, progress=(STAGES.index(stage) + share) / len(STAGES))


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
