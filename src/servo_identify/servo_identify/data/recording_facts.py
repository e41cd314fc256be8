"""What a recording holds, as plain data: duration, period, channels with their ranges, hash."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from servo_twin.recording.recording import COLUMNS, Recording


def facts_of(path: Path, recording: Recording) -> dict[str, Any]:
    """Return what a recording is, as plain data."""
    channels = {name: {'unit': unit, 'min': float(np.nanmin(recording[name])),
                       'max': float(np.nanmax(recording[name])),
                       'mean': float(np.nanmean(recording[name])),
                       'missing': int(np.isnan(recording[name]).sum())}
                for name, unit in COLUMNS.items() if recording.has(name)}
    return {'path': str(path), 'duration': recording.duration, 'period': recording.period,
            'samples': len(recording), 'servo': recording.servo, 'family': recording.family,
            'replicate': recording.replicate, 'channels': channels, 'note': recording.note,
            'warnings': list(recording.warnings), 'sha256': recording.digest}
