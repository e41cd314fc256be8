"""The geared DC motor of paper 003: its twin, and its friction by every learner."""

from .making import make
from .text import comparison_rows, page

__all__ = ['comparison_rows', 'make', 'page']
