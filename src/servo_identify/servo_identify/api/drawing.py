"""A picture that a notebook shows by itself, without pyplot."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from matplotlib.figure import Figure


class Drawing(Figure):
    """A matplotlib figure; a notebook shows it as a picture, `savefig` writes it."""

    def _repr_png_(self) -> bytes:
        held = BytesIO()
        self.savefig(held, format='png', dpi=100)
        return held.getvalue()


def curve_drawing(name: str, curve: dict[str, Any]) -> Drawing:
    """Return a curve over its variable with its band of 90 %, axes in their units."""
    figure = Drawing(figsize=(6.0, 3.6), layout='constrained')
    axes = figure.subplots()
    axes.fill_between(curve['x'], curve['low'], curve['high'], alpha=0.3, label='band of 90 %')
    axes.plot(curve['x'], curve['y'], label='measured')
    axes.set_title(name.replace('_', ' '))
    axes.set_xlabel(f'{curve["variable"].replace("_", " ")}, {curve["unit"]}'.rstrip(', '))
    axes.set_ylabel(curve['y_unit'])
    axes.legend()
    return figure
