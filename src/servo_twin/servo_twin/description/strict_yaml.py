"""YAML as a file of settings needs it: each name once, no aliases, no deep nesting."""

from __future__ import annotations

import re
from typing import Any

import yaml

DEEPEST = 20  # mappings and rows within each other
LONGEST = 300  # digits of a whole number; a float64 holds up to 309


class NotPlain(yaml.YAMLError):
    """YAML that is well formed, and refused; the message says where and why."""


class _Loader(yaml.SafeLoader):
    """YAML whose mappings hold each name once, where YAML itself keeps the last."""

    depth = 0

    def compose_node(self, parent, index):
        event = self.peek_event()
        line = event.start_mark.line + 1
        if isinstance(event, yaml.AliasEvent):
            raise NotPlain(f'an alias (*{event.anchor}) stands in line {line}; write the value')
        self.depth += 1
        if self.depth > DEEPEST:
            raise NotPlain(f'line {line} is nested deeper than {DEEPEST} levels')
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def construct_mapping(self, node, deep=False):
        taken = set()
        for key, _ in node.value:
            name = key.value if isinstance(key, yaml.ScalarNode) else None
            if name in taken:
                raise NotPlain(f'{name!r} is there twice (line {key.start_mark.line + 1})')
            if name is not None:
                taken.add(name)
        return super().construct_mapping(node, deep)


_KINDS = {
    'bool': (r'true|True|TRUE|false|False|FALSE', 'tTfF'),
    'int': (r'[-+]?\d+', '-+0123456789'),
    'float': (r'[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)',
              '-+.0123456789')}
"""
What a word without quotes is, as YAML 1.2 has it, and how it begins.

YAML 1.1 takes off for false, 30:1 for 1801 (a number of base 60), 010 for 8 and 1e-5 for a word.
"""
_TAG = 'tag:yaml.org,2002:'
_Loader.yaml_implicit_resolvers = {
    first: [one for one in several if one[0].removeprefix(_TAG) not in _KINDS]
    for first, several in yaml.SafeLoader.yaml_implicit_resolvers.items()}
for _kind, (_form, _firsts) in _KINDS.items():
    _Loader.add_implicit_resolver(_TAG + _kind, re.compile(f'(?:{_form})$'), list(_firsts))


def _whole(loader: _Loader, node: yaml.ScalarNode) -> int:
    if len(node.value) > LONGEST:
        raise NotPlain(f'line {node.start_mark.line + 1}: a whole number of {len(node.value)} '
                       'digits is more than a float64 holds')
    return int(loader.construct_scalar(node))


_Loader.add_constructor(_TAG + 'int', _whole)


def read_yaml(text: str) -> Any:
    """Return what YAML text holds; raises yaml.YAMLError, of which NotPlain is one."""
    try:
        return yaml.load(text, _Loader)  # noqa: S506  (a SafeLoader that refuses more)
    except NotPlain:
        raise
    except yaml.MarkedYAMLError as problem:
        if said := _of_letters(text, problem):
            raise NotPlain(said) from None
        raise
    except (ValueError, OverflowError) as problem:  # a date that is none, a number too long
        raise NotPlain(f'a value is none: {problem}') from None


_LETTERS = {'\t': 'a tab', '\N{NO-BREAK SPACE}': 'a blank that does not break (U+00A0)',
            '\N{FULLWIDTH COLON}': 'a wide colon', '\N{FULLWIDTH COMMA}': 'a wide comma'}
"""What looks right in an editor, and is nothing of YAML."""


def _of_letters(text: str, problem: yaml.MarkedYAMLError) -> str:
    """Say which letter is none of YAML in the line where reading ended, '' where all are."""
    mark = problem.problem_mark
    lines = text.splitlines()
    if mark is None or mark.line >= len(lines):
        return ''
    wrong = [name for letter, name in _LETTERS.items() if letter in lines[mark.line]]
    return (f'line {mark.line + 1} holds {" and ".join(wrong)}: write plain blanks, colons and '
            'commas') if wrong else ''
