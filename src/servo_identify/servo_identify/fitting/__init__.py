"""Physical parameters from recordings, by output error."""

from .estimate import Estimate
from .output_error import Progress, fit, foresee

__all__ = ['Estimate', 'Progress', 'fit', 'foresee']
