"""The feed drive of paper 001: analytical and hybrid twins of two axes, and their circle."""

from .feed_page import comparison_rows, page
from .feed_results import make

__all__ = ['comparison_rows', 'make', 'page']
