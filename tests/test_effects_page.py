"""The page of the catalogue."""

from pathlib import Path

from servo_twin.effects_page import page
from servo_twin.physics.catalogue import names

PAGE = Path(__file__).parents[1] / 'docs' / 'effects.md'


def test_the_page_of_effects_is_what_the_effects_declare():
    assert PAGE.read_text() == page(), 'write it anew: python -m servo_twin.effects_page ' \
                                       'docs/effects.md'


def test_the_page_has_an_entry_for_every_effect():
    assert all(f'### {name}\n' in page() for name in names())
