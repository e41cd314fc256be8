"""Write docs/symptoms.md and its sketches: ``python tools/signatures [DOCS]``."""

from __future__ import annotations

from pathlib import Path
import sys

import yaml

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from sketches import draw  # noqa: E402  (found beside this file)

HEAD = """# By symptom: which effect looks like this?

You see an error between rig and twin and have a guess to make. Find the symptom, then the sketch that
looks like your data. `servo-identify diagnose` does the same with numbers.

In each sketch the rig with the effect is red, and a twin without it is grey and dashed. The sketches
have no scale. A *balance* is the equation of motion at one place; [glossary.md](glossary.md) has
the other terms. This page is made by `python tools/signatures`.

| you see | look at |
|---|---|
"""
MIDDLE = """
Two effects can look alike in what you recorded. The last column says what tells them apart.

| sketch | effect, and where it shows | what you see | record | do not take it for |
|---|---|---|---|---|
"""


def page() -> str:
    """Return the text of the page."""
    known = yaml.safe_load((HERE / 'effects.yaml').read_text())
    symptoms = ''.join(
        f'| **{one["symptom"]}.** {one["sees"]} | {", ".join(map(_link, one["look_at"]))} |\n'
        for one in known['symptoms'])
    rows = ''.join(
        f'| ![{_plain(one["effect"])}](pictures/signatures/{one.get("sketch", one["effect"])}.svg) '
        f'| <a id="{_anchor(one["effect"])}"></a>**{_plain(one["effect"])}**<br>{one["balances"]} '
        f'| {one["sees"]} | {one["record"]} | {one["not"]} |\n' for one in known['effects'])
    return HEAD + symptoms + MIDDLE + rows


def _plain(effect: str) -> str:
    return effect.replace('_', ' ')


def _anchor(effect: str) -> str:
    return effect.replace('_', '-').replace(' ', '-')


def _link(effect: str) -> str:
    return f'[{_plain(effect)}](#{_anchor(effect)})'


def main(docs: Path) -> None:
    """Write the page and the sketches below a folder."""
    docs.mkdir(parents=True, exist_ok=True)
    (docs / 'symptoms.md').write_text(page())
    draw(docs / 'pictures' / 'signatures')


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parents[1] / 'docs')
