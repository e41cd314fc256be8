"""Temperatures of a recording that no machine has: they are in another unit."""

from __future__ import annotations

import numpy as np

from servo_twin.recording.recording import Recording

from .finding import Finding

HOTTEST = 200.0  # degC, above which no winding, magnet or grease lives; 0 degC are 273 K
KELVIN = 'offset: -273.15'  # of a mapping, which brings K to degC
COLDEST = -273.15  # degC


def temperature_findings(one: Recording) -> list[Finding]:
    """Return whether the temperature may be in K, or is none."""
    known = one['temperature'][np.isfinite(one['temperature'])]
    if not len(known):
        return []
    low, high = float(known.min()), float(known.max())
    if low > HOTTEST:
        return [Finding('amber', f'{one.name}: the temperature is {low:.4g} to {high:.4g} degC, '
                        f'and no servo works above {HOTTEST:g}: is it in K?',
                        f'give temperature the step {KELVIN} in the mapping', one.name)]
    if low < COLDEST:
        return [Finding('amber', f'{one.name}: the temperature is {low:.4g} degC, below the '
                        f'absolute zero of {COLDEST} degC: is it a count of the sensor?',
                        'bring it to degC by scale and offset in the mapping', one.name)]
    return []
