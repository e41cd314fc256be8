"""The pages that are made from declarations: effects, controllers, servo file, messages."""

from pathlib import Path
import subprocess
import sys

from servo_twin.description import controllers_page, servo_file_page
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


def test_the_page_of_the_servo_file_is_what_its_parts_declare():
    assert (DOCS / 'servo_file.md').read_text() == servo_file_page.page(), (
        'regenerate it: python -m servo_twin.description.servo_file_page docs/servo_file.md')


def test_the_page_of_the_messages_is_what_their_files_say(tmp_path):
    tool = DOCS.parent / 'tools' / 'messages_page.py'
    subprocess.run([sys.executable, str(tool), str(tmp_path / 'page.md')], check=True)
    assert (DOCS / 'messages.md').read_text() == (tmp_path / 'page.md').read_text(), (
        'regenerate it: python tools/messages_page.py')
