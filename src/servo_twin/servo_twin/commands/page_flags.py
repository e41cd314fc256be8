"""What all commands that show the page in the browser take."""

from __future__ import annotations

import argparse
import re

PORT = 8470
_NAMESPACE = re.compile(r'/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*/?', re.ASCII)


def add_port(parser: argparse.ArgumentParser | argparse._ArgumentGroup) -> None:
    """Declare the port, for all commands that show the page."""
    parser.add_argument('--port', type=_port, default=PORT, metavar='N',
                        help='of the page on 127.0.0.1, 0: a free one (default %(default)s)')


def _port(text: str) -> int:
    if not text.isdigit() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f'a port is a number from 0 to 65535, not {text!r}')
    return int(text)


def namespace(text: str) -> str:
    """Return the namespace of a rig, for argparse."""
    if not _NAMESPACE.fullmatch(text):
        raise argparse.ArgumentTypeError(f'{text!r} is no namespace of ROS: words of letters, '
                                         'digits and _ that begin with a letter, / between them')
    return text
