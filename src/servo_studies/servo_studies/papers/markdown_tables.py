"""Tables of the pages, as Markdown."""

from __future__ import annotations

from collections.abc import Sequence


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; each row has as many cells as ``head``."""
    lines = [head, ['---'] * len(head), *rows]
    return '\n'.join('| ' + ' | '.join(line) + ' |' for line in lines) + '\n'


TITLES = {
    '000': 'A data-driven dynamic modeling method for servo actuators',
    '001': 'Hybrid Multi-Domain Analytical and Data-Driven Modeling for Feed Systems in Machine '
           'Tools',
    '002': 'Development of an experimental test bench for the validation of prognostic algorithms '
           'for electromechanical actuators',
    '003': 'Data-Driven Identification of Friction Dynamics in Mechatronic Systems using Machine '
           'Learning',
    '004': 'Modelling of a Pan and Tilt Servo System',
}
"""Titles of the papers by their numbers; docs/papers.md has their DOIs."""


def cited(*numbers: str) -> str:
    """Return a line that says what the papers of these numbers are called."""
    return ' '.join(f'Paper {number} is [*{TITLES[number]}*](papers.md#paper-{number}).'
                    for number in numbers)
