"""What a change is made of: which shape it adds to which equation."""

from __future__ import annotations

from dataclasses import dataclass

OF_A_SHAFT = (
    ('dry friction', ('direction',)), ('viscous friction', ('speed',)),
    ('friction', ('direction', 'speed')), ('all friction', ('usual',)),
    ('inertia', ('acceleration',)))
"""What may change of a shaft, and the signals of its equation that go with it."""


@dataclass(frozen=True)
class Candidate:
    """
    One change: its place, its name, and its columns in :attr:`Equations.signals`.

    ``shapes``: (equation, signal, factor) of each column, a tuple of them where it enters several.
    ``as_one``: their sizes go together, so that one that is not seen speaks against the others.
    ``by_angle``: any curve over the angle of the load, in that equation.
    """

    place: str
    name: str
    shapes: tuple[tuple[tuple[int, int, float], ...], ...]
    by_angle: int = -1
    stuck: int = -1
    as_one: bool = False
