"""Text files that are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path


def write_whole(path: str | Path, text: str) -> None:
    """
    Write a text file; where that fails, as on a full disk, what was there stays as it was.

    A link stays one, and what is no file, such as a pipe, is written as it is. Raises OSError
    that names the file.
    """
    path = Path(path).resolve()
    draft = path.with_name(f'.{path.name}.{os.getpid()}')
    try:
        if path.exists() and not path.is_file():
            path.write_text(text, 'utf8')
            return
        draft.write_text(text, 'utf8')
        draft.replace(path)
    except OSError as problem:
        raise OSError(f'{path} cannot be written: {problem.strerror}; make room or choose '
                      'another place') from None
    finally:
        draft.unlink(missing_ok=True)
