"""How long sentences are and which words stand in them: pages, docstrings, messages, comments."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
import re

# What the glossary forbids, and what to write instead.
GLOSSARY = {
    r'bristles?': 'presliding friction, or LuGre',
    r'(?<!integrator )wind-ups?': 'torsion or twist angle; that of an integrator is its windup',
    r'strains?(?! gauge)': 'parameter shift in tolerances',
    r'fallen': 'rejected',
    r'drowned': 'masked',
    r'menus?': 'candidate experiments',
    r'traits?': 'fault or effect',
    r'anew': 'again, or from the start',
    r'asked again': 'run again',
    r'lacks? nothing': 'is free of faults',
    r'foreign(?! function)': 'not in the catalogue, or brought by the user',
    r'withheld': 'left out, or injected',
    r'bump functions?': 'modulating function',
    r'disputed': 'contested',
}
FORBIDDEN = re.compile(r'(?<![\w`./-])(' + '|'.join(GLOSSARY) + r')(?![\w`/=])', re.IGNORECASE)
ABBREVIATIONS = re.compile(r'\b(e\.g|i\.e|etc|vs|cf|Fig|Eq|Eqs|Sec|No|pp|al|approx|resp)\.')
_NO_PROSE = ('#', '|', '>', '<!--', '![')
SENTENCE_END = re.compile(r'(?<=[.!?])["\')\]*_]*\s+(?=["\'(\[*_`]*[A-Z0-9`\\-])')


@dataclass(frozen=True)
class Sentence:
    """One sentence, the line on which its paragraph begins, and whether it is a table's cell."""

    line: int
    text: str
    cell: bool = False

    @property
    def words(self) -> int:
        """Count its words: what has a letter or a digit in it; a code span or formula is one."""
        return sum(bool(re.search(r'\w', word)) for word in self.text.split())


def sentences(text: str, line: int = 1, cell: bool = False) -> Iterator[Sentence]:
    """Yield the sentences of one paragraph of prose."""
    text = re.sub(r'!?\[([^\]]*)\]\([^)]*\)', r'\1', text)
    text = re.sub(r':[a-z]+:`[^`]+`|``[^`]+``|`[^`]+`|\$[^$]+\$', 'CODE', text)
    text = re.sub(r'<[^>]+>|https?://\S+', ' ', text)
    text = ABBREVIATIONS.sub(r'\1', ' '.join(text.split()))
    end = re.compile(SENTENCE_END.pattern + r'|;\s+') if cell else SENTENCE_END  # a cell is a list
    for sentence in end.split(text):
        if re.search(r'\w', sentence):
            yield Sentence(line, sentence, cell)


def paragraphs(markdown: str) -> Iterator[tuple[int, str, bool]]:
    """
    Yield the line and the text of each paragraph, list item and cell, and whether it is a cell.

    Left out are headings, code, formulas on lines of their own, HTML comments, and quotes (``>``)
    of what a command printed.
    """
    kept: list[str] = []
    start, fence, comment = 1, '', False
    for number, line in enumerate([*markdown.splitlines(), ''], 1):
        bare = line.strip()
        mark = re.match(r'(```|~~~|\$\$)', bare)
        if fence:
            fence = '' if bare.endswith(fence) else fence
            continue
        comment = (comment or bare.startswith('<!--')) and '-->' not in bare
        code = line.startswith('    ') and not kept
        breaks = (not bare or mark or comment or bare.startswith(_NO_PROSE)
                  or re.match(r'([-*+]|\d+\.)\s', bare))
        if breaks and kept:
            yield start, ' '.join(kept), False
            kept = []
        if mark:
            fence = '' if bare.endswith(mark[1]) and len(bare) > len(mark[1]) else mark[1]
        elif bare.startswith('|') and not set(bare) <= set('|-: '):
            yield from ((number, cell, True)
                        for cell in re.split(r'(?<!\\)\|', bare) if cell.strip())
        elif not (code or comment or not bare or bare.startswith(_NO_PROSE)):
            start = start if kept else number
            kept.append(re.sub(r'^([-*+]|\d+\.)\s+', '', bare))


def page_sentences(path: Path) -> list[Sentence]:
    """Return the sentences of a page in Markdown."""
    return [one for line, text, cell in paragraphs(path.read_text())
            for one in sentences(text, line, cell)]


def docstring_sentences(path: Path) -> list[Sentence]:
    """Return the sentences of the docstrings of the public objects of a module, and of itself."""
    return [one for node in _public(ast.parse(path.read_text()))
            for line, text in _prose_of(node) for one in sentences(text, line)]


def _public(node: ast.AST) -> Iterator[ast.AST]:
    yield node
    for child in getattr(node, 'body', ()):
        if isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and (
                not child.name.startswith('_')):
            yield from _public(child) if isinstance(child, ast.ClassDef) else (child,)


def _prose_of(node: ast.AST) -> Iterator[tuple[int, str]]:
    text = ast.get_docstring(node)
    if text is None:
        return
    line = node.body[0].lineno
    # A literal block stands after '::', a formula after '.. math::'; both are indented.
    text = re.sub(r'(?m)^\.\. [\w-]+::.*\n(?:[ ]+.*\n?|\n)*', '\n', text + '\n')
    text = re.sub(r'(?m)::\n(?:\n|[ ]+.*\n?)+', '.\n\n', text)
    # Between rows of '=' stands a table; what is indented is a literal block.
    text = re.sub(r'(?ms)^=+ =.*^=+ =+[ =]*$', '\n', text)
    text = re.sub(r'(?m)^(?:    .*\n)+|(?<=\n\n)(?:  .*\n)+', '\n', text)
    # A name with a gap behind it begins an entry of a list of names.
    text = re.sub(r'(?m)^(\S+)  +', r'\n\n\1 ', text)
    # A list of fields or arguments goes on after a semicolon with the next name.
    text = re.sub(r';(?=\s+(?:and )?`)', '.', text)
    for block in re.split(r'\n\s*\n|\n(?=\s*(?:[-*]|\d+\.)\s)', text):
        if block.strip():
            yield line, block


def message_sentences(path: Path) -> list[Sentence]:
    """Return what a module says to people: its strings of three words and more, as they stand."""
    said, parts = [], set()
    for node in ast.walk(ast.parse(path.read_text())):  # what holds a string comes before it
        if isinstance(node, ast.JoinedStr):
            parts |= {id(part) for part in node.values}
            said.append((node.lineno, ''.join(part.value if isinstance(
                part, ast.Constant) else 'CODE' for part in node.values)))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and (
                id(node) not in parts):
            said.append((node.lineno, node.value))
    return [Sentence(line, text) for line, text in said if len(text.split()) > 2]


def comment_sentences(path: Path) -> list[Sentence]:
    """Return the comments of a file whose comments begin with ``#``, a line each."""
    return [Sentence(number, comment) for number, line in enumerate(
        path.read_text().splitlines(), 1) if (comment := line.partition('#')[2].strip())]


def mean(found: list[Sentence]) -> float:
    """Return the mean number of words of sentences outside tables, 0 where there are none."""
    counts = [one.words for one in found if not one.cell]
    return sum(counts) / len(counts) if counts else 0.0


def faults(found: list[Sentence], longest: int = 40) -> list[str]:
    """Return what is wrong with sentences, one line each: too long, or a forbidden word."""
    told = []
    for one in found:
        if one.words > longest:
            told.append(f'line {one.line}: {one.words} words, more than {longest}: {one.text}')
        for word in FORBIDDEN.findall(one.text):
            instead = next(GLOSSARY[key] for key in GLOSSARY
                           if re.fullmatch(key, word, re.IGNORECASE))
            told.append(f'line {one.line}: {word!r}, write {instead}: {one.text}')
    return told
