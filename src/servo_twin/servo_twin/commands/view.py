"""
Show a running rig and its twin, or a bag, in the browser.

  servo-twin view                          the rig of the namespace `rig`, read only
  servo-twin view --control                the page may set values of the twin
  servo-twin view --control --faults SOCK  ... and inject faults into an emulated rig
  servo-twin view BAG                      plays a recording, without ROS

The page is at http://127.0.0.1:PORT, for browsers of this machine alone. Ctrl-C ends it. --json
tells the address as soon as the page is there; its exit_status is null until the end.
"""

from __future__ import annotations

import argparse
import asyncio
from importlib.util import find_spec
from pathlib import Path
import tempfile

from ..bringup.processes import BEGINS, ENDS
from ..nodes.ending import Ending
from .page_flags import add_port, namespace
from .terminal import say, tell, tell_now


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('bag', nargs='?', type=Path, metavar='BAG',
                        help='a bag, or a table to import; left out: the running rig')
    parser.add_argument('--control', action='store_true',
                        help='let the page set values of the twin and inject faults')
    add_port(parser)
    parser.add_argument('--namespace', type=namespace, metavar='NAME',
                        help='of the rig (default: rig, or the only one in the bag)')
    parser.add_argument('--faults', type=Path, metavar='SOCKET',
                        help='that an emulated rig was started with, to inject faults')
    parser.add_argument('--servo', metavar='S.yaml',
                        help='servo file of the twin of a bag, or the name of a shipped one '
                             '(default: what the bag holds)')
    parser.add_argument('--mapping', type=Path, help='mapping file, for a table')
    parser.add_argument('-o', '--output', type=Path, metavar='DIR',
                        help='where answers of diagnoses are kept (default: nowhere)')


def main(arguments: argparse.Namespace) -> int:
    """Serve the page until a signal; returns 0. Raises ValueError for what cannot be shown."""
    if arguments.faults and not arguments.control:
        raise ValueError('--faults needs --control: a read only page injects nothing')
    if not find_spec('tornado'):
        raise ValueError('the live view needs the Python package tornado: '
                         "pip install 'servo_twin[view]'")
    with tempfile.TemporaryDirectory(prefix='servo_twin_view_') as scratch:
        if arguments.bag is None:
            from ..nodes.spinning import started
            from ..view.live_rig import LiveRig
            ending = started([])
            source = LiveRig(arguments.namespace or 'rig')
        else:
            from ..description.shipped import servo_at
            from ..view.played_bag import PlayedBag
            from .any_bag import bag_of
            servo = servo_at(arguments.servo) if arguments.servo else None
            with bag_of(arguments.bag, servo, arguments.mapping, Path(scratch)) as bag:
                source = PlayedBag(bag, servo, arguments.namespace)
            ending = Ending()
        try:
            return asyncio.run(_serve(arguments, source, ending, Path(scratch)))
        finally:
            source.close()


async def _serve(arguments: argparse.Namespace, source, ending: Ending, scratch: Path) -> int:
    from ..view.diagnosis_process import Diagnosis
    from ..view.faults import Faults
    from ..view.server import ADDRESS, serve
    from ..view.viewed import View

    over = asyncio.Event()
    loop = asyncio.get_running_loop()
    ending.then = lambda: loop.call_soon_threadsafe(over.set)
    if ending.asked:  # before anybody could hear it
        return 0
    kept = Diagnosis(arguments.output or scratch / 'answers',
                     lambda: print(BEGINS, flush=True),
                     lambda said: print(f'{ENDS}: {said}', flush=True))
    view = View(source, kept, arguments.control,
                Faults(arguments.faults) if arguments.faults else None)
    try:
        server, port = serve(view, arguments.port)
    except OSError as problem:
        raise ValueError(f'--port {arguments.port} on {ADDRESS} cannot be had: '
                         f'{problem.strerror}; choose another, or 0 for a free one') from None
    may = 'may set values' if arguments.control else 'read only'
    address = f'http://{ADDRESS}:{port}'
    tell(arguments, address=address, control=arguments.control)
    tell_now(arguments)
    say(arguments, f'view: {address} ({may})')
    try:
        await over.wait()
    finally:
        server.stop()
        await view.close()
        await server.close_all_connections()
    return 0
