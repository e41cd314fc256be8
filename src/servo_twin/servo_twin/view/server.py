"""
The server of the view: one page and one WebSocket, for browsers of this machine alone.

It listens on 127.0.0.1. A request whose Host is not this server's is refused, so that no name of
another site can be made to lead here. So is one whose Origin is another site's, and a WebSocket
without an Origin.
"""

from __future__ import annotations

import asyncio
from http import HTTPStatus
from importlib.resources import files
import json
import logging
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.iostream import StreamClosedError
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from ..pages import plotting
from .source import Refused
from .viewed import View

ADDRESS = '127.0.0.1'
SCRIPTS = ('link.js', 'time_plots.js', 'chain.js', 'panels.js', 'control.js', 'view.js')
POLICY = ("default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
          "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
          "frame-ancestors 'none'")
_LONGEST = 1 << 14  # bytes of a message from a browser
_KINDS = {'css': 'text/css', 'js': 'text/javascript', 'html': 'text/html', 'txt': 'text/plain'}


class Guarded:
    """A handler that answers this machine's own pages alone."""

    def initialize(self, view: View, hosts: frozenset[str], **_: Any) -> None:
        """Take what it serves, and the names under which it may be called."""
        self.view, self.hosts = view, hosts

    def prepare(self) -> None:
        """Refuse a Host or an Origin that is not this server's."""
        host, origin = (self.request.headers.get(name) for name in ('Host', 'Origin'))
        if host not in self.hosts:
            raise HTTPError(HTTPStatus.FORBIDDEN, reason='this Host is not served')
        if (origin is None and isinstance(self, WebSocketHandler)) or (
                origin is not None and origin.removeprefix('http://') not in self.hosts):
            raise HTTPError(HTTPStatus.FORBIDDEN, reason='this Origin is not served')

    def set_default_headers(self) -> None:
        """Let nothing be loaded, framed, guessed or kept."""
        for name, value in (('Content-Security-Policy', POLICY), ('Cache-Control', 'no-store'),
                            ('X-Content-Type-Options', 'nosniff'), ('X-Frame-Options', 'DENY'),
                            ('Referrer-Policy', 'no-referrer'),
                            ('Cross-Origin-Resource-Policy', 'same-origin')):
            self.set_header(name, value)
        self.clear_header('Server')


class Asset(Guarded, RequestHandler):
    """One file of the page."""

    def initialize(self, text: str, kind: str, **more: Any) -> None:
        """Take the text that it serves."""
        super().initialize(**more)
        self._text, self._kind = text, kind

    def get(self) -> None:
        """Answer with the file."""
        self.set_header('Content-Type', f'{_KINDS[self._kind]}; charset=utf-8')
        self.finish(self._text)


class AnswerPage(Guarded, RequestHandler):
    """The page of a diagnosis, which brings a policy of its own."""

    def get(self, number: str) -> None:
        """Answer with the page."""
        path = self.view.diagnosis.page(int(number))
        if path is None:
            raise HTTPError(HTTPStatus.NOT_FOUND)
        self.clear_header('Content-Security-Policy')
        self.set_header('Content-Type', 'text/html; charset=utf-8')
        self.finish(path.read_bytes())


class BrowserSocket(Guarded, WebSocketHandler):
    """One browser."""

    busy = 0

    def check_origin(self, origin: str) -> bool:
        """Say whether a page may talk to this; prepare() has looked already."""
        return origin.removeprefix('http://') in self.hosts

    def open(self) -> None:
        """Greet a browser."""
        self.set_nodelay(True)
        self.view.enter(self)

    def on_close(self) -> None:
        """Forget a browser."""
        self.view.leave(self)

    async def on_message(self, message: str | bytes) -> None:
        """Take a request, and say when it is refused."""
        try:
            request = json.loads(message)
            if not isinstance(request, dict):
                raise Refused('a request is a mapping')
            await self.view.ask(self, request)
        except (ValueError, RecursionError) as problem:
            self.say(json.dumps({'refused': str(problem)}))

    def say(self, message: str | bytes | None) -> None:
        """Send a message, if it is one; ``busy`` counts those that are on their way."""
        if message is None:
            return
        try:
            sent = asyncio.ensure_future(self.write_message(message, isinstance(message, bytes)))
        except WebSocketClosedError:
            return
        self.busy += 1
        sent.add_done_callback(self._sent)

    def _sent(self, sent: asyncio.Future) -> None:
        self.busy -= 1
        if not sent.cancelled() and isinstance(sent.exception(), WebSocketClosedError
                                               | StreamClosedError):
            self.view.leave(self)


def serve(view: View, port: int) -> tuple[HTTPServer, int]:
    """
    Listen on a port of this machine, 0: a free one; return the server and the port.

    Raises OSError where the port is taken.
    """
    (listener,) = bind_sockets(port, ADDRESS)
    port = listener.getsockname()[1]
    more = {'view': view, 'hosts': frozenset((f'{ADDRESS}:{port}', f'localhost:{port}'))}
    routes: list = [('/socket', BrowserSocket, more), (r'/answers/(\d{1,6})', AnswerPage, more)]
    for path, text in assets().items():
        kind = path.rpartition('.')[2] if '.' in path else 'html'
        routes.append((path, Asset, more | {'text': text, 'kind': kind}))
    logging.getLogger('tornado.access').setLevel(logging.ERROR)
    server = HTTPServer(Application(
        routes, websocket_ping_interval=10.0, websocket_max_message_size=_LONGEST,
        default_handler_class=_Nothing, default_handler_args=more, log_function=lambda _: None),
        max_body_size=_LONGEST, max_header_size=_LONGEST)
    server.add_socket(listener)
    return server, port


class _Nothing(Guarded, RequestHandler):
    def get(self) -> None:
        """Say that there is no such thing."""
        raise HTTPError(HTTPStatus.NOT_FOUND)


def assets() -> dict[str, str]:
    """Return the files of the page by their paths on the server."""
    own = files(__package__).joinpath('page')
    texts = {f'/{name}': own.joinpath(name).read_text('utf8') for name in SCRIPTS}
    shared = {f'/{name.rpartition("/")[2]}': plotting.plotting(name)
              for name in (*plotting.SCRIPTS, plotting.STYLE, plotting.COLOURS)}
    texts['/uplot_licence.txt'] = plotting.plotting(plotting.LICENCE)
    return {'/': own.joinpath('view.html').read_text('utf8'),
            '/view.css': own.joinpath('view.css').read_text('utf8'), **texts, **shared}
