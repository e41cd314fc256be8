"""All hypotheses for one set of residuals."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from servo_twin.description.nearest_name import or_what
from servo_twin.physics.catalogue import names
from servo_twin.physics.servo import Servo

from ..decisions import FORM
from .builder import Builder, sides_of
from .by_recording import by_recording
from .controller import controller_of
from .dahl import dahl
from .drive import drive_of
from .eddy_brake import eddy_brake
from .friction_by_direction import friction_by_direction
from .hypothesis import Hypothesis, OUTSIDE
from .in_time import in_time
from .next_joint import next_joint
from .patterns import patterns_of
from .readings import readings_of
from .shaft_friction import friction_of
from .torque import torque_of
from .transmission import transmission_of
from .user_effects import user_effects_of
from .values import NAMES, values_of


def hypotheses_of(builder: Builder, residual: np.ndarray,
                  without: Collection[str] = ()) -> list[Hypothesis]:
    """
    Return every hypothesis but those of the mechanisms named in ``without``.

    :func:`check_without` says which names there are.
    ``residual`` (samples,) is what is left without any.
    """
    found: list[Hypothesis] = []
    sides = sides_of(builder)
    for site in sides:
        found += friction_of(builder, site, residual)
        found += friction_by_direction(builder, site)
        found += filter(None, (one(builder, site, residual) for one in (eddy_brake, dahl)))
    if set(builder.samples.present) & {'motor', 'load', 'torque'}:
        found += torque_of(builder, residual)
        found += in_time(builder, residual)
        found += next_joint(builder)
    found += transmission_of(builder, residual)
    found += drive_of(builder, residual)
    found += readings_of(builder, residual)
    found += values_of(builder)
    found += controller_of(builder, residual)
    found += user_effects_of(builder)
    found += by_recording(builder, sides)
    found += patterns_of(builder, sides, without, residual)
    gone = {*without, *(ALIASES[name] for name in without if name in ALIASES)}
    kept = [one for one in found if one.mechanism.name not in gone]
    return [one for one in kept if not any(_is_value(one, value) for value in kept)]


def _is_value(one: Hypothesis, value: Hypothesis) -> bool:
    """Tell whether a mechanism would only add to what the servo file has."""
    if one.path or not value.path or one.mechanism.site != value.mechanism.site or (
            one.columns.size > 1 or value.columns.size > 1):
        return False
    x, y = one.columns.whole()[:, 0], value.columns.whole()[:, 0]
    return bool((x @ y) ** 2 > (1.0 - FORM**2) * (x @ x) * (y @ y))


ALIASES = {f'parameter:{path.rpartition(".")[2]}': name for path, name in NAMES.items()}
"""Values whose error has a name of its own, under either name."""


def check_without(without: Collection[str], servo: Servo) -> None:
    """Raise ValueError for a name that no hypothesis of a servo could have; no data are needed."""
    paths = [path for path, _ in servo.declarations()]
    values = {f'parameter:{path.rpartition(".")[2]}' for path in paths
              if path.split('.')[0] in ('drive', 'mechanism')}
    values |= {f'parameter:{path.removeprefix("effects.")}' for path in paths
               if path.startswith('effects.')}
    effects = {*names(), *ALIASES.values(), 'controller_mismatch', *OUTSIDE}
    for name in without:
        if name in effects | values | {*ALIASES}:
            continue
        of_value = name.startswith('parameter:')
        known = sorted(values if of_value else effects | values)
        raise ValueError(f'there is no {"value" if of_value else "effect"} {name!r} to leave out; '
                         f'{or_what(name, known)}')
