"""Text files that are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path


def write_whole(path: str | Path, text: str) -> None:
    """
    Write a text file; where that fails, as on a full disk, what was there stays as it was.

    Raises OSError that names the file.
    """
    path = Path(path)
    draft = path.with_name(f'.{path.name}.{os.getpid()}')
    try:
        draft.write_text(text, 'utf8')
        draft.replace(path)
    except OSError as problem:
        raise OSError(f'{path} cannot be written: {problem.strerror}; make room or choose '
                      'another place') from None
    finally:
        draft.unlink(missing_ok=True)
