"""
Laws of the orders that show once other causes are fitted.

Orders are read off a residual. Beside a gap that is many times larger, that of the beginning shows
none of a ripple that a motor has too.
"""

from __future__ import annotations

from servo_twin.physics.effect import Effect

from .candidates import candidates_of, has_order
from .library import build_library
from .screening import Screening
from .shape_values import shape_values


def take_in_further_orders(screening: Screening, chosen: list[int]) -> None:
    """Add periodic laws of the orders that are left beside some causes to those screened."""
    stack, known = screening.stack, screening.library.candidates
    shapes = shape_values(stack, screening.residual(chosen))

    def of_orders(effect: type[Effect], site: str) -> list[dict[str, float]]:
        return shapes(effect, site) if has_order(effect) else []

    tried = {(one.key, one.shapes) for one in known}
    further = [one for one in candidates_of(stack.extended, of_orders)
               if one.order and (one.key, one.shapes) not in tried]
    found = build_library(stack, further, lambda share: None)
    for one in zip(found.candidates, found.tables, found.amplitudes, strict=True):
        screening.add(*one)
