"""What the command `diagnose` prints of an answer: it ..."""

from io import StringIO
from types import SimpleNamespace

from rich.console import Console

from servo_identify.commands.diagnose import _show


def shown(*effects, shrink):
    """Return what is printed of effects (name, shrink alone), which together remove a share."""
    which = [SimpleNamespace(effect=name, site='load', rung='law', confidence={'mechanism': 1.0},
                             parameters={'level': {'value': 2.0, 'std': 0.1, 'unit': 'N m'}},
                             shrink_realised=alone, ambiguous_with=()) for name, alone in effects]
    report = SimpleNamespace(where=(), which=which, gap={'shrink': shrink}, warnings=(),
                             defaults=())
    console = Console(width=200, record=True, file=StringIO())
    _show(report, console)
    return console.export_text()


def test_it_says_why_the_shrink_of_a_row_is_another_than_that_of_the_sentence():
    assert 'taken out of the new file' in shown(('gravity', 0.39), shrink=0.82)
    assert 'taken out of the new file' not in shown(('gravity', 0.82), shrink=0.84)


def test_an_effect_without_which_nothing_is_worse_shrinks_nothing():
    text = shown(('gravity', 0.8), ('hysteresis', -0.02), shrink=0.8)
    assert 'none' in text and '-2 %' not in text and 'level 2 +- 0.1 N m' in text
