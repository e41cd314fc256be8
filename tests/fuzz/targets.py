"""All that is fuzzed, by name, and what was found before."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bag_targets
import program_targets
import table_targets
import wire_targets
import yaml_targets

TARGETS = {target.name: target for kind in (
    yaml_targets, wire_targets, table_targets, bag_targets, program_targets)
    for target in kind.TARGETS}


def cases(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield (target, file) of what was found before."""
    for path in sorted(folder.glob('*/*')):
        yield path.parent.name, path
