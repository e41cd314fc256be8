"""Which node of a run stands still: a process that hangs has not ended, and says nothing."""

from __future__ import annotations

from collections.abc import Mapping

SILENT = 5.0  # s without a report, which each node makes every second: it stood still for 4 s
MOST = 0.5  # s of one look at most: who was stopped itself has not listened meanwhile


class Silences:
    """Counts for how long each of some nodes has said nothing, while somebody listened."""

    def __init__(self, nodes: tuple[str, ...]) -> None:
        self._heard = dict.fromkeys(nodes, -1)
        self._since = dict.fromkeys(nodes, 0.0)

    def look(self, heard: Mapping[str, int], seconds: float) -> list[str]:
        """
        Return the nodes that stand still.

        ``heard`` is how often each was heard by now, ``seconds`` how long the last look is ago.
        """
        for name, count in self._heard.items():
            now = heard.get(name, 0)
            self._since[name] = 0.0 if now != count else self._since[name] + min(seconds, MOST)
            self._heard[name] = now
        return [name for name, since in self._since.items() if since > SILENT]
