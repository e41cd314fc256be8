"""The feed drive of paper 001: analytical and hybrid twins of two axes, and their circle."""

from .making import make
from .text import comparison_rows, page

__all__ = ['comparison_rows', 'make', 'page']
