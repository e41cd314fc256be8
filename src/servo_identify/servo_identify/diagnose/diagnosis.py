"""What a diagnosis gives: the report, the servo files to hand over, and the evidence."""

from __future__ import annotations

from dataclasses import dataclass

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .answer.evidence import Evidence
from .answer.report import GapReport


@dataclass(frozen=True)
class Diagnosis:
    """The report, the servo file to hand over (with values moved, ``refit``), the evidence."""

    report: GapReport
    augmented: Servo
    refit: Servo
    evidence: Evidence

    @property
    def recordings(self) -> list[Recording]:
        """The recordings that effects were looked for in."""
        return [one.measured.recording for one in self.evidence.found.samples.errors]
