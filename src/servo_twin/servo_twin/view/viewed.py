"""What the browsers look at, and who looks: samples when there are any, facts when they change."""

from __future__ import annotations

import asyncio
import json
from typing import Any, Protocol

from tornado.ioloop import PeriodicCallback

from .diagnosis_process import Diagnosis
from .faults import Faults
from .looker import is_number, Looker
from .source import Refused, Source
from .traces import NAMES, units

_TRACES = 33  # ms between two messages of samples
_FACTS = 8  # of those messages to one of facts
_RESTS = 5.0  # s after the last browser has gone that samples are still taken
_LAST = 60.0  # s that a diagnosis is of


class Socket(Protocol):
    """The connection to one browser; ``busy`` until all that was said is on its way."""

    busy: int

    def say(self, message: str | bytes | None) -> None:
        """Send a message, if it is one."""

    def close(self, code: int, reason: str) -> None:
        """End the connection."""


class View:
    """
    What is looked at and who looks; ``control``: whether the page may change anything.

    Samples are worked on while somebody looks, and some seconds longer.
    """

    def __init__(self, source: Source, diagnosis: Diagnosis, control: bool,
                 faults: Faults | None = None) -> None:
        self.source, self.diagnosis, self.control, self.faults = source, diagnosis, control, faults
        self._lookers: dict[Socket, Looker] = {}
        self._tick = PeriodicCallback(self._advance, _TRACES)
        self._count = 0
        self._rest: asyncio.TimerHandle | None = None
        self._asking: asyncio.Future | None = None
        self._untold: set[Socket] = set()

    def enter(self, socket: Socket) -> None:
        """Begin to serve a browser."""
        self._lookers[socket] = Looker()
        socket.say(json.dumps({'hello': {
            'kind': self.source.kind, 'control': self.control, 'names': NAMES,
            'units': units(self.source.servo())}}))
        if self._rest is not None:
            self._rest.cancel()
            self._rest = None
        if not self._tick.is_running():
            self.source.look(True)
            self._tick.start()

    def leave(self, socket: Socket) -> None:
        """End serving a browser."""
        self._lookers.pop(socket, None)
        self._untold.discard(socket)
        if not self._lookers and self._rest is None and self._tick.is_running():
            self._rest = asyncio.get_running_loop().call_later(_RESTS, self._sleep)

    def _sleep(self) -> None:
        self._rest = None
        if not self._lookers:
            self._tick.stop()
            self.source.look(False)

    def _advance(self) -> None:
        self.source.advance()
        traces, facts = self.source.traces, None
        self._count += 1
        if self._count % _FACTS == 0:
            facts = self._facts()
        if self.control and self.faults is not None and self._count % (4 * _FACTS) == 0:
            self._asking = asyncio.ensure_future(self.faults.refresh())
        for socket, looker in list(self._lookers.items()):
            if facts is not None:
                self._untold.add(socket)
            if socket.busy:  # a slow browser gets more at once, later
                continue
            socket.say(looker.traces(traces))
            if socket in self._untold:
                self._untold.remove(socket)
                facts = self._facts() if facts is None else facts
                socket.say(looker.facts(facts))
                socket.say(looker.density(traces))

    def _facts(self) -> dict[str, Any]:
        traces = self.source.traces
        zero = traces.stamp
        facts = {**self.source.facts(), 'units': units(self.source.servo()), 'levels': {
            name: float(f'{level:.3g}') for name, level in traces.levels().items()},
            'diagnosis': self.diagnosis.facts,
            'events': [{'at': round((one.stamp - zero) * 1e-9, 3), 'kind': one.kind,
                        'text': one.text, 'source': one.source}
                       for one in self.source.events()] if traces.period else []}
        if traces.period:
            facts['rate'] = {'rate': float(f'{1.0 / traces.period:.6g}'),
                             'kept': round(traces.size * traces.period)}
        if self.control and self.faults is not None:
            facts['faults'] = self.faults.facts
        return facts

    async def ask(self, socket: Socket, request: dict[str, Any]) -> None:
        """Do what a browser asks for; raises Refused."""
        if 'show' in request and isinstance(request['show'], dict):
            self._lookers[socket].show(request['show'])
        elif 'play' in request and isinstance(request['play'], dict):
            playing, at = request['play'].get('playing'), request['play'].get('at')
            self.source.play(playing if isinstance(playing, bool) else None,
                             None if at is None else _number(at, 'at'))
        elif 'diagnose' in request:
            if request['diagnose']:
                self.diagnosis.begin(lambda: self.source.recording(_LAST))
            else:
                self.diagnosis.cancel()
        elif 'set' in request or 'fault' in request:
            await self._change(request)
        else:
            raise Refused(f'there is no request {list(request)}')

    async def _change(self, request: dict[str, Any]) -> None:
        if not self.control:
            raise Refused('this view is read only: start it with --control to change anything')
        wanted = request.get('set', request.get('fault'))
        if not isinstance(wanted, dict) or not isinstance(wanted.get('path'), str):
            raise Refused('a change names a path and a value')
        path, value = wanted['path'], _number(wanted.get('value'), wanted['path'])
        if 'set' in request:
            await self.source.set_value(path, value)
        elif self.faults is None:
            raise Refused('no emulated rig was named: start the view with --faults SOCKET')
        else:
            await self.faults.set(path, value)

    async def close(self) -> None:
        """End everything."""
        self._tick.stop()
        await self.diagnosis.close('the view ended before the diagnosis did: record longer, or '
                                   'give the bag to servo-identify diagnose')
        for socket, looker in list(self._lookers.items()):
            socket.say(looker.facts({'diagnosis': self.diagnosis.facts}))
            socket.close(1001, 'the view ends')


def _number(value: Any, name: str) -> float:
    if not is_number(value):
        raise Refused(f'{name} = {value!r} is no number')
    return float(value)
