"""What white noise is after a difference, and by its median."""

from __future__ import annotations

import numpy as np

FOURTH = np.sqrt(70.0)
"""By which a fourth difference of white noise is larger than the noise."""

QUARTILE = 0.6745
"""Median size of a normal deviate."""
