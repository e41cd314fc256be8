"""The pan-and-tilt of paper 004: step and slow sine, five harmonic drives, two axes."""

from .making import make
from .text import comparison_rows, page

__all__ = ['comparison_rows', 'make', 'page']
