"""The numbers of a running twin as its ROS parameters: read, followed and set."""

from __future__ import annotations

from concurrent.futures import Future
from threading import Lock
from time import monotonic
from typing import Any

from rcl_interfaces.msg import ParameterEvent, ParameterType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient

from .source import Refused

_FILE = 'servo_file'
_ANSWERS = 5.0  # s within which a twin answers, or is asked again


class TwinValues:
    """
    Follows the values of a twin; all but `listed` is called by the thread of its node.

    A value of the servo is a parameter with a dot in its name, a range and a number.
    """

    def __init__(self, node: Node, twin: str) -> None:
        self.servo_file = ''
        """What the twin was configured with; empty while no twin is there."""
        self._twin = twin
        self._client = AsyncParameterClient(node, twin)
        self._values: dict[str, dict[str, Any]] = {}
        self._lock = Lock()
        self._asked: float | None = None  # when it was asked for everything, s
        self._known = False
        self._client.on_parameter_event(self._changed)

    def listed(self) -> list[dict[str, Any]]:
        """Return path, value, unit, low, high and meaning of each, in the order of the servo."""
        with self._lock:
            return [dict(one) for one in self._values.values()]

    def look(self) -> None:
        """Ask for everything when a twin has come, forget everything when it has gone."""
        there = self._client.services_are_ready()
        if not there:
            self._known, self._asked = False, None
            self.servo_file = ''
            with self._lock:
                self._values = {}
        elif not self._known and (self._asked is None or monotonic() - self._asked > _ANSWERS):
            self._asked = monotonic()
            self._client.list_parameters(callback=self._described)

    def set(self, path: str, value: float, answered: Future) -> None:
        """
        Set a value; ``answered`` gets the reason why it was refused, empty where it was not.

        Who does not wait any more gets none: the answer of a twin that hung may come late.
        """
        if not answered.set_running_or_notify_cancel():
            return
        with self._lock:
            known = path in self._values
        if not known:
            answered.set_exception(Refused(f'the twin {self._twin} has no value {path!r}'))
            return

        def hear(future: Any) -> None:
            (result,) = future.result().results
            answered.set_result('' if result.successful else result.reason or 'refused')

        self._client.set_parameters([Parameter(path, Parameter.Type.DOUBLE, float(value))], hear)

    def _described(self, future: Any) -> None:
        names = [name for name in future.result().result.names
                 if '.' in name and not name.startswith('qos_overrides.')]
        self._client.describe_parameters(
            [*names, _FILE], lambda told: self._ask(told.result().descriptors))

    def _ask(self, descriptors: list) -> None:
        ranged = [one for one in descriptors if one.floating_point_range]
        names = [*(one.name for one in ranged), _FILE]
        self._client.get_parameters(names, lambda told: self._got(ranged, told.result().values))

    def _got(self, descriptors: list, values: list) -> None:
        found = {}
        for one, value in zip(descriptors, values, strict=False):
            if value.type == ParameterType.PARAMETER_DOUBLE:
                meaning, _, unit = one.description.rpartition(' Unit: ')
                limits = one.floating_point_range[0]
                found[one.name] = {
                    'path': one.name, 'value': value.double_value,
                    'unit': '' if unit == 'none.' else unit.removesuffix('.'),
                    'low': limits.from_value, 'high': limits.to_value, 'meaning': meaning}
        self.servo_file = values[-1].string_value if values else ''
        self._asked, self._known = None, bool(found)
        with self._lock:
            self._values = found

    def _changed(self, event: ParameterEvent) -> None:
        if event.node != self._twin:
            return
        if any('.' in one.name for one in (*event.new_parameters, *event.deleted_parameters)):
            self._known = False  # another servo: asked for at the next look
            return
        with self._lock:
            for one in event.changed_parameters:
                if one.name in self._values:
                    self._values[one.name]['value'] = one.value.double_value
