"""All that is fuzzed, by name, and what was found before."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import bag_targets
import program_targets
import table_targets
import wire_targets
import yaml_targets

_ON_THE_BUS = ('packet', 'sdo')

TARGETS = {target.name: target for kind in (
    yaml_targets, wire_targets, table_targets, bag_targets, program_targets)
    for target in kind.TARGETS}

FAMILIES = {'settings': [target.name for target in yaml_targets.TARGETS],
            'devices': [target.name for target in wire_targets.TARGETS
                        if target.name not in _ON_THE_BUS],
            'bus': [*_ON_THE_BUS],
            'tables': [target.name for target in table_targets.TARGETS],
            'bags': [target.name for target in bag_targets.TARGETS],
            'programs': [target.name for target in program_targets.TARGETS]}
"""Names of targets by where their inputs come from; a run gives each family the same time."""


def family_of(name: str) -> str:
    """Return the family of a target."""
    return next(family for family, members in FAMILIES.items() if name in members)


def seconds_of(names: Sequence[str], whole: float) -> dict[str, float]:
    """Part the time of a run evenly among the families of some targets, and within each."""
    families = [family_of(name) for name in names]
    each = whole / len(set(families))
    return {name: each / families.count(family)
            for name, family in zip(names, families, strict=True)}


def cases(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield (target, file) of what was found before."""
    for path in sorted(folder.glob('*/*')):
        yield path.parent.name, path
