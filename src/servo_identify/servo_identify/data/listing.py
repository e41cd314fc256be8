"""What a file beside recordings says of them: family, replicate and a note."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from .packed import stem_of

LISTING = 'recordings.yaml'


def beside(path: Path) -> dict[str, Any]:
    """Return what a recordings.yaml in the table's folder says of it."""
    listing = path.parent / LISTING
    if not listing.is_file():
        return {}
    try:
        content = yaml.safe_load(listing.read_text('utf8'))
    except yaml.YAMLError as error:
        raise ValueError(f'{listing} is no YAML: {error}') from None
    if isinstance(content, dict) and 'recordings' in content:
        content = content['recordings']
    if isinstance(content, list):
        content = {str(entry.get('file', '')): entry for entry in content
                   if isinstance(entry, dict)}
    if not isinstance(content, dict):
        raise ValueError(f'{listing}: give {{file name: {{family: ..., replicate: ...}}}}')
    entry = next((content[name] for name in (path.name, path.stem, stem_of(path))
                  if name in content), {})
    if not isinstance(entry, dict):
        raise ValueError(f'{listing}: {path.name}: {entry!r} is not '
                         '{family: ..., replicate: ...}')
    facts = {name: entry[name] for name in ('family', 'replicate', 'note') if name in entry}
    for name, kind in (('family', str), ('replicate', int), ('note', str)):
        if not isinstance(facts.get(name, kind()), kind):
            raise ValueError(f'{listing}: {path.name}: {name} = {facts[name]!r} is of the wrong '
                             f'kind, it is a {"number" if kind is int else "text"}')
    return facts
