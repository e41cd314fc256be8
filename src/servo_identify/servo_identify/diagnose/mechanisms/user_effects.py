"""Effects of the user's own as hypotheses: their law along the measured motion, at each site."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from servo_twin.physics.catalogue import registered
from servo_twin.physics.effect import Effect
from servo_twin.physics.servo import Placed, ServoError

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import Columns, Hypothesis, Mechanism

SHAPES = (0.3, 1.0, 3.0)  # times the default of a shape without a grid


def user_effects_of(builder: Builder) -> Iterator[Hypothesis]:
    """Yield a hypothesis for each registered effect, site and set of shapes worth trying."""
    for effect in registered():
        amplitudes, shapes = effect.amplitudes(), effect.shapes()
        grids = [effect.parameters[name].grid or tuple(
            share * float(np.asarray(effect.parameters[name].default)) for share in SHAPES)
            for name in shapes]
        tried = int(np.prod([len(grid) for grid in grids])) if grids else 1
        for site in effect.sites:
            for some in product(*grids):
                values = dict(zip(shapes, some, strict=True))
                table = _columns(builder, effect, site, amplitudes, values)
                if table is None:
                    continue
                mechanism = Mechanism(effect.name, effect.port, site,
                                      tuple(sorted(effect.variables())) or ('direction',), 'none')
                one = builder.hypothesis(
                    mechanism, Columns(table), [0] * len(amplitudes), tried=max(tried, 1),
                    detail={'effect': effect, 'amplitudes': amplitudes, 'shapes': values})
                if one:
                    yield one


def _columns(builder: Builder, effect: type[Effect], site: str, amplitudes: Sequence[str],
             values: Mapping[str, float]) -> np.ndarray | None:
    """Return what one unit of each amplitude does to all residuals, (samples, n)."""
    samples, name = builder.samples, f'{effect.name}_tried'
    placed, columns = Placed(name, effect, site), []
    off = {n: value for n in amplitudes if (value := effect.parameters[n].off) is not None}
    try:
        servo = samples.servo.with_effects(placed, values=placed.paths({**off, **values}))
    except ServoError:
        return None
    errors = [EquationErrors(servo, one.measured) for one in samples.errors]
    before = [one.residuals(servo.theta) for one in errors]
    for amplitude in amplitudes:
        step = float(np.asarray(effect.parameters[amplitude].default)) or 1.0
        moved = servo.with_values(placed.paths({amplitude: step})).theta
        change = {}
        for number, (one, base) in enumerate(zip(errors, before, strict=True)):
            after = one.residuals(moved)
            change[number] = {key: (after[key] - base[key]) / step for key in after}
        columns.append(samples.place(change, 1)[:, 0])
    return np.column_stack(columns)
