"""The emulated bench on a bus of its own, with its driver: what an experiment can be tried on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
import sys
import tempfile

from servo_twin.bringup.processes import Processes, wait_until

START = 60.0  # s; the first start compiles


@contextmanager
def emulated_bench(processes: Processes, namespace: str, rig: Path, driver: Path,
                   rate: float = 1000.0, turned: Sequence[str] = (),
                   watchdog: float | None = None) -> Iterator[None]:
    """
    Start bus, emulated rig and driver in a namespace; ``processes`` ends them.

    ``watchdog`` is after how many s of silence the emulated drive stops; None: after the usual.
    Raises ProcessError when one of them does not start.
    """
    with tempfile.TemporaryDirectory(prefix='servo_identify_') as folder:
        bus = Path(folder) / 'rig.can'
        processes.start('can_hub', python('servo_rig_driver.can_bus.can_hub', str(bus)))
        wait_until(bus.exists, 'the bus is there', START, processes)
        words = [word for one in turned for word in ('--set', one)]
        words += [] if watchdog is None else ['--watchdog', str(watchdog)]
        processes.start('emulated_rig', python(
            'servo_rig_driver.emulated.rig_process', '--rig', str(rig), '--interface', 'unix_bus',
            '--channel', str(bus), *words))
        wait_until(lambda: f' on unix_bus {bus}' in processes.said('emulated_rig'),
                   'the emulated rig is on the bus', START, processes)
        values = {'bus.interface': 'unix_bus', 'bus.channel': str(bus), 'sync_period': 1.0 / rate,
                  'autostart': 'true', 'enable_after_loss': 'true'}
        processes.start('driver', [*python('servo_rig_driver.driver.driver_node'),
                                   *ros(namespace, values, driver)], first=True)
        yield


def python(module: str, *arguments: str) -> list[str]:
    """Return the command that runs a module."""
    return [sys.executable, '-m', module, *arguments]


def ros(namespace: str, values: dict[str, object], file: Path | None = None) -> list[str]:
    """Return the words that give a node its namespace and parameters."""
    words = ['--ros-args', '-r', f'__ns:=/{namespace}']
    if file is not None:
        words += ['--params-file', str(file)]
    for name, value in values.items():
        words += ['-p', f'{name}:={value}']
    return words
