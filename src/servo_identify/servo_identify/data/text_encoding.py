"""The letters and lines of a text file: its encoding, how it begins and ends."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
import re

from .east_asian import letters_of
from .unit_symbols import parsed, UnitError

BEGIN = 100_000  # bytes that are looked at before a file is read
BY_BYTES = ('latin-1', 'mac_roman', 'cp850')
"""Letters of a byte each, of Windows, of old Macs and of DOS; of equals the first is taken."""
_BRACKET = re.compile(r'[\[(]([^\[\]()]+)[\])]')
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
    elif b'\0' in begin.rstrip(b'\0\r\n'):
        raise ValueError(f'{path} is no table of text: it holds bytes that are no letters; export '
                         'it as CSV')
    else:
        encoding, begin = 'utf-8-sig', begin.rstrip(b'\0\r\n') if b'\0' in begin else begin
    try:
        return encoding, begin.decode(encoding)
    except UnicodeDecodeError as problem:
        if encoding == 'utf-8-sig' and problem.start < len(begin) - 4:  # not cut inside a letter
            encoding = letters_of(begin) or max(BY_BYTES, key=lambda one: _units(
                begin.decode(one)))
        return encoding, begin.decode(encoding, 'ignore')


def filled(path: Path) -> Path | BytesIO:
    """Return a file, or what is in it before the zeros of rows that a logger never filled."""
    with path.open('rb') as file:
        file.seek(max(0, path.stat().st_size - 4))
        if not file.read().rstrip(b'\r\n').endswith(b'\0'):
            return path
    return BytesIO(path.read_bytes().rstrip(b'\0\r\n') + b'\n')


def _units(begin: str) -> int:
    """Return how many words beyond ASCII stand in the header as a unit, alone or in brackets."""
    found = 0
    for cell in re.split(r'[;,\t\r\n"]', begin):
        if not cell.isascii():
            bracket = _BRACKET.search(cell)
            unit = (bracket.group(1) if bracket else cell).strip()
            try:
                parsed(unit)
            except UnitError:
                continue
            found += not unit.isascii()
    return found


def last_line(path: Path, encoding: str) -> str:
    """Return the last line of a file that is not blank, '' where there is none."""
    with path.open('rb') as file:
        file.seek(max(0, path.stat().st_size - BEGIN))
        lines = LINE_END.split(file.read().decode(encoding, 'ignore'))
    return next((one for one in reversed(lines) if one.strip()), '')
