"""Questions on a terminal, asked until the answer can be."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from servo_twin.description.nearest_name import or_what

Ask = Callable[[str, str], str]
"""Asks a question with the answer that Enter stands for ('' for none); returns the answer."""


def one_of(ask: Ask, question: str, choices: Sequence[str], usual: str | None = None) -> str:
    """Ask for one of some choices; Enter stands for ``usual``, or for the first of them."""
    def judge(text: str) -> None:
        if text not in choices:
            raise ValueError(or_what(text, choices))
    listed = ', '.join(choices[:12])
    return until(ask, f'{question} ({listed})', choices[0] if usual is None else usual, judge)


def until(ask: Ask, question: str, default: str, judge: Callable[[str], object]) -> str:
    """Ask until the answer is judged well, with what was wrong with the last one."""
    asked = question
    while True:
        answer = ask(asked, default).strip() or default
        try:
            judge(answer)
        except ValueError as problem:
            asked = f'{problem}\n{question}'
        else:
            return answer
