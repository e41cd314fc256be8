"""YAML as a file of settings needs it: each name once, no aliases, no deep nesting."""

from __future__ import annotations

import re
from typing import Any

import yaml

DEEPEST = 20  # mappings and rows within each other


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


_Loader.add_implicit_resolver(
    'tag:yaml.org,2002:float', re.compile(r'[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$'),
    list('-+.0123456789'))  # YAML 1.1 takes 1e-5 for a word: it wants 1.0e-5


def read_yaml(text: str) -> Any:
    """Return what YAML text holds; raises yaml.YAMLError, of which NotPlain is one."""
    try:
        return yaml.load(text, _Loader)  # noqa: S506  (a SafeLoader that refuses more)
    except (ValueError, OverflowError) as problem:  # a date that is none, a number too long
        raise NotPlain(f'a value is none: {problem}') from None
