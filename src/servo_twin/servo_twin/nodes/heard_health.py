"""What the nodes of one namespace last said of their health on /diagnostics."""

from __future__ import annotations

from collections import Counter

from diagnostic_msgs.msg import DiagnosticArray


class HeardHealth:
    """
    Keeps the last word of each node of a namespace.

    ``facts`` maps a node (`driver`, `twin`, `recorder` ...) to what it last said, ``sentences`` to
    the worst of its messages, ``levels`` to its severity (0 is well), ``counts`` to how often it
    was heard.
    """

    def __init__(self, namespace: str) -> None:
        self.facts: dict[str, dict[str, str]] = {}
        self.sentences: dict[str, str] = {}
        self.levels: dict[str, int] = {}
        self.counts: Counter[str] = Counter()
        self._prefix = namespace.strip('/')

    def hear(self, message: DiagnosticArray) -> None:
        """Take what was published."""
        worst: dict[str, int] = {}
        for status in message.status:
            owner, _, _ = status.name.partition(':')
            prefix, _, name = owner.strip().lstrip('/').rpartition('/')
            if prefix != self._prefix:
                continue
            self.counts[name] += 1
            facts = self.facts.setdefault(name, {})
            facts.update({value.key: value.value for value in status.values})
            level = int.from_bytes(status.level, 'little')
            if level > worst.get(name, -1):
                worst[name] = self.levels[name] = level
                self.sentences[name] = status.message
