"""The bench of the tests of the check: changes of a recording, and its findings of one level."""

from dataclasses import replace

from bench_recording import SERVO

from servo_identify.data.recording_check import check
from servo_twin.description.servo_file import load

BENCH = load(SERVO)


def of_level(level, recording, servo=BENCH):
    """Return the findings of a level: green, amber or red."""
    return [one for one in check([recording], servo) if one.level == level]


def changed(recording, **columns):
    """Return the recording with other columns."""
    return replace(recording, columns={**recording.columns, **columns})
