"""What a recording holds, as plain data: duration, period, channels with their ranges, hash."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from servo_twin.recording.parts import parts_of
from servo_twin.recording.recording import COLUMNS, Recording

from .long_bags import Long


def facts_of(path: Path, recording: Long,
             parts: Iterable[Recording] | None = None) -> dict[str, Any]:
    """
    Return what a recording of any length is, as plain data.

    ``parts`` are those of the recording, where somebody else looks at them on the way.
    """
    known, total = dict.fromkeys(COLUMNS, 0), dict.fromkeys(COLUMNS, 0.0)
    low, high = dict.fromkeys(COLUMNS, np.inf), dict.fromkeys(COLUMNS, -np.inf)
    for part in parts_of(recording) if parts is None else parts:
        for name in COLUMNS:
            values = part[name][np.isfinite(part[name])]
            known[name] += len(values)
            total[name] += float(values.sum())
            low[name] = min(low[name], float(values.min(initial=np.inf)))
            high[name] = max(high[name], float(values.max(initial=-np.inf)))
    channels = {name: {'unit': unit, 'min': low[name], 'max': high[name],
                       'mean': total[name] / known[name],
                       'missing': len(recording) - known[name]}
                for name, unit in COLUMNS.items() if known[name]}
    return {'path': str(path), 'duration': recording.duration, 'period': recording.period,
            'samples': len(recording), 'sequence': recording.sequence, 'servo': recording.servo,
            'family': recording.family, 'replicate': recording.replicate, 'channels': channels,
            'note': recording.note, 'warnings': list(recording.warnings),
            'sha256': recording.digest}
