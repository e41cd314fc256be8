"""`NODE --help`: what a node is, and how its parameters are given; nothing is started."""

from __future__ import annotations

import sys


def asked_for_help(name: str, about: str | None, settings: str) -> bool:
    """
    Print what a node is where its command line asks for it, and return whether it did.

    ``about`` is the docstring of its module, ``settings`` the file that holds all its parameters.
    """
    if not {'-h', '--help'} & set(sys.argv[1:]):
        return False
    print(f'usage: {name} [--ros-args [-p NAME:=VALUE] [--params-file FILE] [-r __ns:=/RIG]]\n\n'
          f'{(about or "").strip()}\n\nParameters, each with its meaning: {settings}')
    return True
