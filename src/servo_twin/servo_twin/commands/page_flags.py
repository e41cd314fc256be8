"""What all commands that show the page in the browser take."""

from __future__ import annotations

import argparse

PORT = 8470


def add_port(parser: argparse.ArgumentParser | argparse._ArgumentGroup) -> None:
    """Declare the port, for all commands that show the page."""
    parser.add_argument('--port', type=_port, default=PORT, metavar='N',
                        help='of the page on 127.0.0.1, 0: a free one (default %(default)s)')


def _port(text: str) -> int:
    if not text.isdigit() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f'a port is a number from 0 to 65535, not {text!r}')
    return int(text)
