"""The pan-and-tilt of paper 004: step and slow sine, five harmonic drives, two axes."""

from .pan_tilt_page import comparison_rows, page
from .pan_tilt_results import make

__all__ = ['comparison_rows', 'make', 'page']
