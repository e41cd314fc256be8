"""The letters and lines of a text file: its encoding, how it begins and ends."""

from __future__ import annotations

from pathlib import Path
import re

from .east_asian import letters_of

BEGIN = 100_000  # bytes that are looked at before a file is read
LINE_END = re.compile(r'\r\n|\n|\r')


def text_of(path: Path) -> tuple[str, str]:
    """Return the encoding of a file, and how it begins; raises ValueError for one of no text."""
    with path.open('rb') as file:
        begin = file.read(BEGIN)
    if begin[:4] in (b'\xff\xfe\0\0', b'\0\0\xfe\xff'):
        encoding = 'utf-32'
    elif begin[:2] in (b'\xff\xfe', b'\xfe\xff'):
        encoding = 'utf-16'
    elif len(begin) > 1 and begin.count(b'\0') >= 0.4 * len(begin) and 0 in begin[:2]:
        encoding = 'utf-16-le' if begin[1] == 0 else 'utf-16-be'  # which has no mark
    elif b'\0' in begin:
        raise ValueError(f'{path} is no table of text: it holds bytes that are no letters; export '
                         'it as CSV')
    else:
        encoding = 'utf-8-sig'
    try:
        return encoding, begin.decode(encoding)
    except UnicodeDecodeError as problem:
        if encoding == 'utf-8-sig' and problem.start < len(begin) - 4:  # not cut inside a letter
            encoding = letters_of(begin) or 'latin-1'
        return encoding, begin.decode(encoding, 'ignore')


def last_line(path: Path, encoding: str) -> str:
    """Return the last line of a file that is not blank, '' where there is none."""
    with path.open('rb') as file:
        file.seek(max(0, path.stat().st_size - BEGIN))
        lines = LINE_END.split(file.read().decode(encoding, 'ignore'))
    return next((one for one in reversed(lines) if one.strip()), '')
