"""
A third emulated rig, offline, from the literature; it knows no other package.

    python -m servo_studies.third_rig SEED -o DIR [--first N] [--kind KIND] [--list]
    python -m servo_studies.third_rig --mechanisms

writes each case of a seed as a folder: `servo.yaml`, one CSV per recording with the columns of an
import, `recordings.yaml`, and `truth.json`. From Python:

    for case in cases(seed, first=20):
        case.machine, case.servo, case.truth, case.kind, case.recordings, case.severity

The machine of a case is drawn within the tolerances of its servo file. What a fault moves within
such a tolerance starts from its edge, so that a severity counts what is beyond.
"""
