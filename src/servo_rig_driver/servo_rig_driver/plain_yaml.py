"""YAML of files with physical values: what one program reads so and another so is refused."""

from __future__ import annotations

from collections.abc import Iterator
import re
from typing import Any

import yaml

DEEPEST = 20  # mappings and rows within each other
LONGEST = 300  # digits of a whole number; a float64 holds up to 309
_DOUBTFUL = {'int': (r'[-+]?0[0-7]+|.*:.*', 'a number to base 8 or 60'),
             'float': (r'.*:.*', 'a number to base 60'),
             'bool': (r'(?i)(?!true$|false$).*', 'true or false')}
"""
How a word without quotes looks that YAML 1.1 takes for another value than YAML 1.2 does, by its
kind, and what it is taken for: a ratio of 30:1 for 1801.
"""


def read_yaml(text: str) -> Any:
    """
    Return what YAML text holds; raises yaml.YAMLError that names the line.

    A name that stands twice in a mapping is refused, and a deep nesting.
    """
    _refuse_deep(text)
    loader = yaml.SafeLoader(text)  # the one in C ends the process where a text nests too deeply
    try:
        tree = loader.get_single_node()
        _refuse_doubtful(tree)
        return None if tree is None else loader.construct_document(tree)
    finally:
        loader.dispose()


def _refuse_deep(text: str) -> None:
    """Raise yaml.YAMLError where mappings, rows or `<<` lie too deep within each other."""
    depth = 0
    for event in yaml.parse(text, yaml.SafeLoader):  # as they come, without a call for each level
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        line = event.start_mark.line + 1
        if depth > DEEPEST:
            raise yaml.YAMLError(f'line {line} is nested deeper than {DEEPEST} levels')
        if isinstance(event, yaml.ScalarEvent) and event.value == '<<' and event.style is None:
            raise yaml.YAMLError(f'line {line}: << takes in another mapping; write its values')


def _refuse_doubled(one: yaml.MappingNode) -> None:
    taken = set[str]()
    for key, _ in one.value:
        if isinstance(key, yaml.ScalarNode):
            if key.value in taken:
                raise yaml.YAMLError(f'line {key.start_mark.line + 1}: {key.value!r} is there '
                                     'twice')
            taken.add(key.value)


def _refuse_doubtful(tree: yaml.Node | None) -> None:
    for node in _words(tree):
        if node.tag.endswith(':int') and len(node.value) > LONGEST:
            raise yaml.YAMLError(f'line {node.start_mark.line + 1}: a whole number of '
                                 f'{len(node.value)} digits is more than a float64 holds')
        form, taken = _DOUBTFUL.get(node.tag.rpartition(':')[2], ('(?!)', ''))
        if node.style is None and re.fullmatch(form, node.value):
            raise yaml.YAMLError(f'line {node.start_mark.line + 1}: {node.value} would be read as '
                                 f'{taken}; write a plain number, true or false, or put quotes '
                                 'around a text')


def _words(node: Any) -> Iterator[yaml.ScalarNode]:
    """Yield all words of YAML, each once; raises yaml.YAMLError for a name that is there twice."""
    waiting, seen = [node], set[int]()
    while waiting:
        one = waiting.pop()
        if one is None or id(one) in seen:  # an alias leads to what was seen
            continue
        seen.add(id(one))
        if isinstance(one, yaml.ScalarNode):
            yield one
        elif isinstance(one, yaml.MappingNode):
            _refuse_doubled(one)
            waiting += [part for pair in one.value for part in pair]
        else:
            waiting += one.value
