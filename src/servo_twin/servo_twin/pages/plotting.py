"""What pages with plots in a browser share: uPlot, ticks, units and colours."""

from __future__ import annotations

from importlib.resources import files

SCRIPTS = ('uplot/uPlot.iife.min.js', 'plots.js')
"""Scripts of every page with plots, in the order in which they run."""

STYLE = 'uplot/uPlot.min.css'
COLOURS = 'colours.css'
LICENCE = 'uplot/LICENSE'


def plotting(name: str) -> str:
    """Return the text of one of the files that pages with plots share."""
    return files(__package__).joinpath(name).read_text('utf8')
