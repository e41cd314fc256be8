"""Physical parameters from recordings, by output error."""

from .estimate import Estimate
from .output_error import fit, foresee, misfit, Progress

__all__ = ['Estimate', 'Progress', 'fit', 'foresee', 'misfit']
