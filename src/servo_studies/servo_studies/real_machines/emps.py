"""
EMPS, the linear axis of the nonlinear system identification benchmarks.

The inverse model of the literature is a regression of the force on acceleration, speed and sign of
speed (IDIM-LS): position through a zero-phase Butterworth filter, central differences, the
regressors and the force through one decimation filter. Its relative error is
:math:`100\\,|f - W\\hat x| / |f|`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfiltfilt

from servo_identify.data.table_import import import_table
from servo_identify.fit.estimate import Estimate
from servo_identify.fit.output_error import fit, misfit
from servo_identify.learn.friction.friction_samples import differences
from servo_twin.description import servo_file
from servo_twin.description.shipped import shipped
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.recording.recording import Recording

CUTOFF, DECIMATION = 100.0, 10  # Hz; samples: one of ten is kept
PUBLISHED = {'symmetric_percent': 4.08, 'asymmetric_percent': 3.11,
             'position_percent': 0.0138, 'force_percent': 5.85}


@dataclass(frozen=True)
class Inverse:
    """Least squares on the force: names and values of the parameters, relative error in %."""

    parameters: dict[str, float]
    percent: float


def recording_of(data: Path) -> Recording:
    """Return the recording of the shared data folder."""
    return import_table(data / 'emps/DATA_EMPS.mat', shipped('servos/emps.yaml'),
                        mapping=shipped('imports/emps.yaml'))


def inverse_model(recording: Recording, gain: float, asymmetric: bool,
                  cutoff: float = CUTOFF, decimation: int = DECIMATION) -> Inverse:
    """
    Regress the force ``gain * voltage`` on the motion.

    Symmetric: mass, viscous, Coulomb, offset. Asymmetric: mass, viscous and Coulomb by direction
    (the offset is then the difference of both levels).
    """
    rate = 1.0 / recording.period
    calm = sosfiltfilt(butter(4, cutoff, fs=rate, output='sos'), recording['motor_position'])
    speed, acceleration = np.nan_to_num(differences(calm, recording.period))
    ahead, back = speed > 0.0, speed < 0.0
    if asymmetric:
        columns = {'mass': acceleration, 'viscous forward': speed * ahead,
                   'viscous reverse': speed * back, 'coulomb forward': 1.0 * ahead,
                   'coulomb reverse': -1.0 * back}
    else:
        columns = {'mass': acceleration, 'viscous': speed, 'coulomb': np.sign(speed),
                   'offset': np.ones_like(speed)}
    slow = butter(4, 0.8 * rate / 2.0 / decimation, fs=rate, output='sos')
    inner = slice(100, -100, decimation)
    design = np.column_stack([sosfiltfilt(slow, c)[inner] for c in columns.values()])
    force = sosfiltfilt(slow, gain * recording['voltage'])[inner]
    found, *_ = np.linalg.lstsq(design, force, rcond=None)
    left = force - design @ found
    return Inverse(dict(zip(columns, found.tolist(), strict=True)),
                   float(100.0 * np.linalg.norm(left) / np.linalg.norm(force)))


def closed_loop(recording: Recording) -> tuple[Estimate, dict[str, float]]:
    """
    Fit with the controller simulated; return the estimate and relative errors in %.

    Position against the measured position, force against the measured force, as norms.
    """
    servo = servo_file.load(shipped('servos/emps.yaml')).with_effects(
        Placed('offset', find('asymmetric_friction'), 'load'),
        values={'effects.offset.difference': 0.0})
    estimate = fit(servo, [recording], [
        'mechanism.load_inertia', 'effects.coulomb.level', 'effects.viscous.slope',
        'effects.offset.difference'], mode='closed_loop', tolerance=False)
    left = misfit(estimate.servo, [recording], mode='closed_loop')
    size = {c: float(np.sqrt(np.mean(recording[c] ** 2))) for c in left}
    return estimate, {'position_percent': 100.0 * left['motor_position'] / size['motor_position'],
                      'force_percent': 100.0 * left['voltage'] / size['voltage']}


def figures(data: Path) -> dict:
    """Return ours beside those published."""
    recording = recording_of(data)
    gain = servo_file.load(shipped('servos/emps.yaml')).values['drive.torque_constant']
    symmetric = inverse_model(recording, gain, False)
    asymmetric = inverse_model(recording, gain, True)
    estimate, errors = closed_loop(recording)
    return {'symmetric_percent': symmetric.percent, 'asymmetric_percent': asymmetric.percent,
            **errors, 'symmetric': symmetric.parameters, 'asymmetric': asymmetric.parameters,
            'closed_loop': dict(estimate.values), 'closed_loop_std': dict(estimate.std),
            'published': PUBLISHED}
