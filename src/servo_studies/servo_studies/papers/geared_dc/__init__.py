"""The geared DC motor of paper 003: its twin, and its friction by every learner."""

from .geared_dc_page import comparison_rows, page
from .geared_dc_results import make

__all__ = ['comparison_rows', 'make', 'page']
