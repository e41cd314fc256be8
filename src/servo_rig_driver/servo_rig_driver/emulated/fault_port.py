"""
A socket by which faults of a running emulated rig are switched: off unless somebody asks for it.

One line of JSON a request, one an answer. `{}` asks, `{"set": {path: value}}` switches first. The
answer holds the rig's name, its faults as they stand, and under `error` what was refused.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import json
import math
import os
from pathlib import Path
import socket
import socketserver
from threading import Thread
from typing import Any

from .emulated_bench import Bench
from .rig_file import RigFileError
from .rig_physics import WORLDS

STRENGTHS = {
    'withheld.gravity': 4.0, 'withheld.spring_load': 8.0, 'withheld.quadratic_drag': 30.0,
    'withheld.payload_inertia': 1.0, 'withheld.friction_drift': 0.5, 'withheld.local_spot': 8.0,
    'withheld.rest_ageing': 5.0, 'withheld.command_delay': 2e-3,
    'withheld.drive_dead_band': 0.2, 'withheld.drive_gain': 0.05, 'withheld.drive_offset': 0.1,
    'withheld.supply_sag': 20.0, 'withheld.torque_constant': 0.1,
    'withheld.torque_saturation': 0.1, 'withheld.torque_ripple': 0.05, 'withheld.cogging': 0.02,
    'withheld.motor_drag': 0.03, 'withheld.load_drag': 8.0, 'withheld.load_sensor_delay': 3e-3,
    'withheld.load_eccentricity': 1e-3, 'withheld.motor_eccentricity': 0.02,
    'withheld.torque_sensor_gain': 0.05, 'withheld.torque_sensor_offset': 2.0,
    'withheld.current_sensor_gain': 0.05, 'withheld.current_sensor_offset': 0.05,
    'withheld.controller_gain': 0.1, 'withheld.controller_integral': 0.2, 'withheld.slosh': 1.0,
}
"""Faults that can be switched: a strength that shows on the RV bench, in the property's unit."""

LONGEST = 10_000  # bytes of a request


class FaultPort:
    """
    Serves requests on a Unix socket that only its user may open, from now until close().

    ``do`` runs a function between two frames of the bus and returns its result. Raises OSError
    where the path is taken or cannot be made.
    """

    def __init__(self, path: Path, bench: Bench, do: Callable[[Callable[[], Any]], Any]) -> None:
        self.path, self._bench, self._do = path, bench, do
        known = WORLDS[bench.rig.kind].by_path
        self._faults = {name: known[name] for name in STRENGTHS if name in known}
        # made by nobody else's leave: between bind and chmod nobody else can open it
        before = os.umask(0o177)
        try:
            self._server = _Server(str(path), self._handler())
        finally:
            os.umask(before)
        Thread(target=self._server.serve_forever, args=(0.1,), name='faults', daemon=True).start()

    def close(self) -> None:
        """End, and remove the socket."""
        self._server.shutdown()
        self._server.server_close()
        self.path.unlink(missing_ok=True)

    def answer(self, line: bytes) -> dict[str, Any]:
        """Return the answer to one request."""
        try:
            request = json.loads(line)
            wanted = request.get('set', {}) if isinstance(request, dict) else None
            if not isinstance(wanted, dict):
                raise RigFileError('a request is {} or {"set": {path: value}}')
            if wanted:
                self._set(wanted)
            return self._state()
        except (ValueError, TimeoutError) as problem:
            return self._state() | {'error': str(problem)}

    def _set(self, wanted: Mapping[str, Any]) -> None:
        for path, value in wanted.items():
            if path not in self._faults:
                raise RigFileError(f'there is no fault {path!r} on {self._bench.rig.name}; there '
                                   f'are {list(self._faults)}')
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(
                    value):
                raise RigFileError(f'{path} = {value!r} is no number')
        self._do(lambda: self._bench.change(wanted))

    def _state(self) -> dict[str, Any]:
        values = self._bench.rig.values
        return {'rig': self._bench.rig.name, 'faults': [
            {'path': path, 'value': values[path], 'unit': one.unit, 'low': one.low,
             'high': one.high, 'meaning': one.meaning, 'strength': STRENGTHS[path]}
            for path, one in self._faults.items()]}

    def _handler(self) -> type[socketserver.BaseRequestHandler]:
        port = self

        class Handler(socketserver.StreamRequestHandler):
            def handle(self) -> None:
                while line := self.rfile.readline(LONGEST):
                    self.wfile.write(json.dumps(port.answer(line)).encode() + b'\n')

        return Handler


class _Server(socketserver.ThreadingMixIn, socketserver.UnixStreamServer):
    daemon_threads = True
    address_family = socket.AF_UNIX

    def handle_error(self, request: object, client_address: object) -> None:
        """Let a client that went away be gone."""
