"""The pages that are made from declarations: effects and controllers."""

from pathlib import Path

from servo_twin.description import controllers_page
from servo_twin.description.effects_page import page
from servo_twin.physics.catalogue import names
from servo_twin.physics.servo import CONTROLLERS

DOCS = Path(__file__).parents[2] / 'docs'
PAGE = DOCS / 'effects.md'


def test_the_page_of_effects_is_what_the_effects_declare():
    assert PAGE.read_text() == page(), (
        'regenerate it: python -m servo_twin.description.effects_page docs/effects.md')


def test_the_page_has_an_entry_for_every_effect():
    assert all(f'### {name}\n' in page() for name in names())


def test_the_page_of_controllers_is_what_the_controllers_declare():
    assert (DOCS / 'controllers.md').read_text() == controllers_page.page(), (
        'regenerate it: python -m servo_twin.description.controllers_page docs/controllers.md')
    assert all(f'## `{name}`\n' in controllers_page.page() for name in CONTROLLERS
               if name != 'none')
