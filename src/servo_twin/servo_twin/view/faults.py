"""Switches the faults of an emulated rig, by the socket that it makes when it is asked to."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

from .source import Refused

_PATIENCE = 5.0  # s
_LONGEST = 1 << 20  # bytes of an answer


class Faults:
    """
    The faults of one emulated rig behind a Unix socket.

    ``facts`` holds the rig's name and its faults: path, value, unit, low, high, meaning and a
    strength that shows. It is None while the rig is not there.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.facts: dict[str, Any] | None = None

    async def refresh(self) -> None:
        """Ask how the faults stand."""
        try:
            self.facts = await self._ask({})
        except (OSError, ValueError):
            self.facts = None

    async def set(self, path: str, value: float) -> None:
        """Give a fault a strength, 0 or what it is without: off. Raises Refused."""
        try:
            facts = await self._ask({'set': {path: value}})
        except (OSError, ValueError) as problem:
            raise Refused(f'the emulated rig does not answer at {self.path}: {problem}') from None
        refused = facts.pop('error', None)
        self.facts = facts
        if refused:
            raise Refused(refused)

    async def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        async with asyncio.timeout(_PATIENCE):
            reader, writer = await asyncio.open_unix_connection(str(self.path), limit=_LONGEST)
            try:
                writer.write(json.dumps(request).encode() + b'\n')
                facts = json.loads(await reader.readline())
            finally:
                writer.close()
        if not isinstance(facts, dict) or not isinstance(facts.get('faults'), list):
            raise ValueError('that is no answer of a rig')
        return facts
