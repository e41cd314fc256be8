"""
Where the socket of a bus lies that is given by a name alone: a folder that only its user enters.

A path below /tmp that is known beforehand may be taken by another user first, and everybody may
look at it. This folder has the rights 0700 and its owner is checked each time.
"""

from __future__ import annotations

import os
from pathlib import Path
from stat import S_ISDIR
import tempfile

from ..home_path import at_home


def private_folder() -> Path:
    """
    Return the folder for sockets of this user, made where it is not there.

    It is ``servo_twin`` in XDG_RUNTIME_DIR, or ``servo_twin_UID`` in the folder for temporary
    files. Raises PermissionError for one that belongs to somebody else or that others may enter.
    """
    runtime = os.environ.get('XDG_RUNTIME_DIR', '')
    folder = (Path(runtime) / 'servo_twin' if runtime and os.access(runtime, os.W_OK)
              else Path(tempfile.gettempdir()) / f'servo_twin_{os.geteuid()}')
    try:
        folder.mkdir(mode=0o700)
    except FileExistsError:
        found = folder.lstat()
        if not S_ISDIR(found.st_mode) or found.st_uid != os.geteuid() or found.st_mode & 0o077:
            raise PermissionError(
                0, f'{folder} is not a folder that user {os.geteuid()} alone may enter (owner '
                   f'{found.st_uid}, rights {found.st_mode & 0o7777:o}); remove it, or give the '
                   'whole path of a socket') from None
    return folder


def socket_path(channel: str) -> str:
    """
    Return the path of a socket: a name without a slash lies in the private folder.

    Raises ValueError for ~ of nobody.
    """
    return str(at_home(channel)) if '/' in channel else str(private_folder() / channel)
