"""The faults: how each is made and unmade, what has to come of it, and who has to name it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import os
from random import Random
import signal
import subprocess
import sys
from time import sleep

from bench import Bench, CONFIG

SPARE = 1 << 20  # bytes that a process may still take where memory is short
NOTHING: Callable[[], None] = lambda: None  # noqa: E731


@dataclass(frozen=True)
class Fault:
    """
    One fault: ``make`` begins it, ``unmake`` takes its cause away.

    ``zero`` says that the drive must lose its torque, ``named`` whose status must not be well
    meanwhile (empty: nobody need say anything), ``hand`` that an operator then has to activate the
    driver, ``gap`` that samples may be missing, which the running number then tells. ``pairs``
    says whether another fault may come with it, ``beside`` whether it burdens the whole machine.
    """

    name: str
    make: Callable[[], None]
    unmake: Callable[[], None] = NOTHING
    zero: bool = False
    named: str = ''
    hand: bool = False
    gap: bool = True
    pairs: bool = True
    beside: bool = False


def all_faults(bench: Bench, graph, random: Random) -> dict[str, Fault]:
    """Return every fault of a bench by its name; ``graph`` sends what nodes are asked."""
    found = []
    for name in bench.names:
        if name == 'proxy':
            continue  # a tool of the test, and its witness
        stops = name not in ('recorder', 'twin', 'identify')
        named = {'twin': '', 'recorder': '', 'identify': '', 'driver': ''}.get(name, 'driver')
        for word, number in (('TERM', signal.SIGTERM), ('KILL', signal.SIGKILL)):
            lingers = name.endswith('hub') and word == 'TERM'  # it serves on for 3 s
            # as long as a process serves on after TERM, the fault has not come yet
            found.append(Fault(f'{name} {word}', _sends(bench, name, number),
                               lambda name=name: bench.ended_by(name),
                               zero=stops and not lingers, named='' if lingers else named,
                               hand=stops))
        if name not in ('rig_hub', 'driver_hub'):  # a stopped hub is a stopped bus: below
            found.append(Fault(f'{name} STOP', _sends(bench, name, signal.SIGSTOP),
                               _sends(bench, name, signal.SIGCONT), zero=stops, named=named,
                               hand=stops))

    def clean() -> None:
        bench.wire('clean')

    for name, values, zero in (
            ('silent', {}, True), ('drop', {'share': 0.02}, False),
            ('delay', {'seconds': 0.005}, False), ('double', {'share': 0.2}, False),
            ('reorder', {'share': 0.1}, False), ('short', {'share': 0.02}, False),
            ('flip', {'share': 0.01}, False), ('jitter', {'seconds': 0.004}, False),
            ('noise', {}, False), ('stuck', {}, False), ('nan', {}, False), ('turn', {}, False)):
        found.append(Fault(f'wire {name}', _tells(bench, name, values), clean, zero=zero,
                           named='driver' if name in ('silent', 'short') else '', hand=True))

    started: list[subprocess.Popen] = []

    def starts(*commands: list[str]) -> Callable[[], None]:
        def make() -> None:
            started.extend(subprocess.Popen(one, stdout=subprocess.DEVNULL,
                                            stderr=subprocess.DEVNULL) for one in commands)
        return make

    def ends() -> None:
        for child in started:
            child.kill()
            child.wait()
        started.clear()

    burn = [sys.executable, '-c', 'while True: pass']
    found.append(Fault('processors starved', starts(*[burn] * 4), ends, beside=True))
    twin = [sys.executable, '-m', 'servo_rig_driver.emulated.rig_process', '--rig',
            str(CONFIG / 'rigs' / 'rv_bench.yaml'), '--interface', 'unix_bus', '--channel',
            str(bench.folder / 'rig.can')]
    # an emulated rig that hears another one of its id leaves, and the first one goes on
    found.append(Fault('a second node of each id', starts(twin), ends, hand=True))
    guest = bench.node('servo_twin.nodes.twin_node', servo_file='rv_bench', autostart='true')
    guest[guest.index(f'__ns:=/{bench.namespace}')] = '__ns:=/guest'
    found.append(Fault('a participant that vanishes', starts(guest), ends, beside=True))
    rival = bench.node('servo_rig_driver.driver.driver_node', CONFIG / 'driver.yaml', **{
        'bus.interface': 'unix_bus', 'bus.channel': bench.folder / 'driver.can',
        'autostart': 'true'})
    rival[rival.index(f'__ns:=/{bench.namespace}')] = '__ns:=/rival'
    found.append(Fault('a second driver', starts(rival), ends, named=''))

    for name, act in (('odd parameters', graph.odd_parameters),
                      ('odd commands', graph.odd_commands), ('odd servo files', graph.odd_servo)):
        found.append(Fault(name, lambda act=act: act(random), gap=False))
    if bench.clock.works:  # by more than command_timeout; alone, for a new driver stamps by it
        found += [Fault(f'clock {word}', lambda way=way: bench.clock.set(
            way * random.choice((0.5, 5.0, 3607.0))), lambda: bench.clock.set(0.0), zero=True,
            named='driver', hand=True, pairs=False)
            for word, way in (('forward', 1.0), ('back', -1.0))]
    if os.geteuid() == 0:  # who else may take a limit back
        found += [Fault(f'memory short for {name}', lambda name=name: bench.spare(name, SPARE),
                        lambda name=name: bench.spare(name, None), hand=name == 'driver')
                  for name in ('driver', 'twin', 'recorder', *(['identify'] * bench.identify))]
        found += _of_disks(bench, starts, ends)
    return {fault.name: fault for fault in found}


def _sends(bench: Bench, name: str, number: int) -> Callable[[], None]:
    return lambda: bench.signal(name, number)


def _tells(bench: Bench, mode: str, values: dict) -> Callable[[], None]:
    return lambda: bench.wire(mode, **values)


def _of_disks(bench: Bench, starts, ends) -> list[Fault]:
    """Return what a second recorder meets on a disk that is full, or becomes read-only."""
    place = bench.folder / 'small_disk'

    def mounted(*options: str) -> bool:
        place.mkdir(exist_ok=True)
        return subprocess.run(['mount', '-t', 'tmpfs', '-o', 'size=1m', 'tmpfs', str(place)],
                              capture_output=True, check=False).returncode == 0

    def take_down() -> None:
        ends()
        subprocess.run(['umount', '-l', str(place)], capture_output=True, check=False)

    recorder = bench.node('servo_rig_driver.record.recorder_node', output=place / 'bag')

    def full() -> None:
        if mounted():
            (place / 'filler').write_bytes(bytes(900_000))
            starts(recorder)()

    def read_only() -> None:
        if mounted():
            starts(recorder)()
            sleep(1.5)
            subprocess.run(['mount', '-o', 'remount,ro', str(place)], capture_output=True,
                           check=False)

    return [Fault('disk full', full, take_down, gap=False),
            Fault('disk read-only', read_only, take_down, gap=False)]

