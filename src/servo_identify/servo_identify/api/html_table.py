"""A small table for a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape


def html_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as HTML; all cells are text and are escaped."""
    head = ''.join(f'<th>{escape(one)}</th>' for one in headings)
    body = ''.join('<tr>' + ''.join(f'<td>{escape(one)}</td>' for one in row) + '</tr>'
                   for row in rows)
    return f'<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'
