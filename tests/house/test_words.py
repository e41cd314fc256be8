"""Pages and docstrings are read by people: short sentences, and the terms of the field."""

from pathlib import Path

from prose import (
    comment_sentences,
    docstring_sentences,
    faults,
    mean,
    message_sentences,
    page_sentences,
    paragraphs,
    sentences,
)
import pytest

ROOT = Path(__file__).resolve().parents[2]
MOST_ON_AVERAGE = 22.0  # words a sentence, tables aside

PAGES = sorted(str(path.relative_to(ROOT)) for path in [*ROOT.glob('*.md'),
                                                        *ROOT.glob('docs/*.md')])
# The studies name faults as their tables do.
PRODUCT = ('servo_twin', 'servo_rig_driver', 'servo_identify')
MODULES = sorted(path for package in PRODUCT
                 for path in (ROOT / 'src' / package / package).rglob('*.py'))


def wrong_with(page: str) -> list[str]:
    """Return what is wrong with a page, a line each."""
    found = page_sentences(ROOT / page)
    average = mean(found)
    long = [f'{average:.1f} words a sentence on average, more than {MOST_ON_AVERAGE:g}']
    return [*(long if average > MOST_ON_AVERAGE else []), *faults(found)]


@pytest.mark.parametrize('page', PAGES)
def test_a_page_reads_as_one_speaks(page):
    told = wrong_with(page)
    assert not told, '\n'.join([page, *told])


def test_docstrings_read_as_one_speaks():
    told = [f'{path.relative_to(ROOT)}: {one}' for path in MODULES
            for one in faults(docstring_sentences(path))]
    assert not told, '\n'.join(told)


def test_docstrings_are_short_on_average():
    assert mean([one for path in MODULES for one in docstring_sentences(path)]) < MOST_ON_AVERAGE


def test_messages_and_help_speak_in_the_terms_of_the_field():
    told = [f'{path.relative_to(ROOT)}: {one}' for path in MODULES
            for one in faults(message_sentences(path), longest=1000)]
    assert not told, '\n'.join(told)


def test_comments_of_files_that_people_edit_speak_in_the_terms_of_the_field():
    files = [*ROOT.glob('config/**/*.yaml'), *ROOT.glob('src/*/launch/*.yaml'),
             *ROOT.glob('src/servo_twin_msgs/*/*')]
    told = [f'{path.relative_to(ROOT)}: {one}' for path in sorted(files)
            for one in faults(comment_sentences(path), longest=1000)]
    assert len(files) > 40 and not told, '\n'.join(told)


def test_a_forbidden_word_is_named_with_what_to_write_instead():
    (told,) = faults(list(sentences('The bristles of the brush bend.')))
    assert "'bristles'" in told and 'LuGre' in told


@pytest.mark.parametrize('text', [
    'The key `wind_up` and the file wind_up_damping.py keep their names.',
    'A strain gauge reads the torque.',
    'The integrator wind-up is limited.',
])
def test_names_in_code_and_terms_of_the_field_pass(text):
    assert faults(list(sentences(text))) == []


def test_a_sentence_is_counted_over_its_lines_and_not_over_the_paragraph():
    page = 'One two\nthree four. Five `a b c` six.\n\n```\nno prose here\n```\n| cell one | x |\n'
    found = [one for line, text, cell in paragraphs(page) for one in sentences(text, line, cell)]
    assert [(one.words, one.cell) for one in found] == [
        (4, False), (3, False), (2, True), (1, True)]
    assert mean(found) == 3.5


def test_a_sentence_too_long_is_said_with_its_line():
    (told,) = faults(list(sentences(' '.join(['word'] * 41) + '.', line=7)))
    assert told.startswith('line 7: 41 words')
