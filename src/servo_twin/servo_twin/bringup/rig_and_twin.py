"""Bus, rig, driver, twin, recorder and player as processes, without ROS's launch."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
import tempfile
from time import monotonic, sleep

from rich.console import Console
from rich.live import Live

from ..nodes.session_node import ACTIVATE, CONFIGURE, DEACTIVATE, Session
from .command_lines import node, python
from .own_namespace import AT_FIRST, AT_LAST, look_around, NODES, outlast, refuse_taken
from .processes import BEGINS, ENDS, ProcessError, Processes, wait_until
from .silences import Silences, SILENT
from .terminal_view import numbers, view

START = 60.0  # s that a node gets to be there; the first start compiles
_SETTLE = 0.5  # s between seeing all readers and the first sample, and behind the last one
_PLAYER_WAITS = 4.0 * START  # s for the first sample: it is there before all others have started
_UNTOLD = 'the driver is not configured'  # its word before it says why it cannot be
_REPORT = 1.2  # s after which the last diagnostics are there


@dataclass(frozen=True)
class Page:
    """The live view in the browser: its port, and whether it may change anything."""

    port: int
    control: bool


@dataclass(frozen=True)
class Bench:
    """What to run: files, namespace, sampling (Hz, samples a message), excitation (s)."""

    folder: Path
    servo: Path
    driver: Path
    rig: Path | None
    turned: tuple[str, ...]
    namespace: str
    mode: str
    rate: float | None
    block: int
    family: str
    command: str | None
    settings: tuple[str, ...]
    duration: float
    page: Page | None = None
    quiet: bool = False

    @property
    def bag(self) -> Path:
        """Where the bag of the run is to stand."""
        return self.folder / self.family


@dataclass(frozen=True)
class Outcome:
    """What a run came to: the counts in one line, and each process's share of a core."""

    counts: str
    cpu: dict[str, float]


def record(bench: Bench, bag: Path) -> Outcome:
    """
    Bring all up, play the excitation into a bag, take all down; return what it came to.

    Raises ProcessError when a part does not start or ends too early; no process is left behind.
    """
    with (tempfile.TemporaryDirectory(prefix='servo_twin_') as bus,
          Processes(bench.folder / 'logs') as processes, Session(bench.namespace) as session):
        _start(bench, bag, Path(bus) / 'rig.can', processes, session)
        begin, before = monotonic(), processes.cpu_seconds()
        early = False
        try:
            _watch(bench, processes, session, begin)
        except KeyboardInterrupt:
            early = True
            print('ending early')
            processes.ask('player')  # one that hangs must not keep the drive
        seconds, after = monotonic() - begin, processes.cpu_seconds()
        _take_down(session, processes)
        processes.stop('player')
        if bench.page is not None and not early:
            let_answer(processes)
        cpu = {name: (taken - before[name]) / seconds for name, taken in after.items()}
        return Outcome(numbers(seconds, session.facts), cpu)


def _start(bench: Bench, bag: Path, bus: Path, processes: Processes, session: Session) -> None:
    faults = bus.with_name('faults') if bench.rig and bench.page and bench.page.control else None
    say = Console().print
    say('starting: ' + ('' if bench.rig is None else 'bus, rig, ') + 'recorder, twin, driver')
    # its reports are listened for, see _watch
    driver = {'block_size': bench.block, 'autostart': False, 'diagnostics_period': 1.0}
    period = [] if bench.rate is None else ['--period', str(1.0 / bench.rate)]
    if bench.rate is not None:
        driver['sync_period'] = 1.0 / bench.rate
    if bench.rig is not None:
        driver |= {'bus.interface': 'unix_bus', 'bus.channel': str(bus),
                   'enable_after_loss': True}  # an emulated motor hurts nobody
        processes.start('can_hub', python('servo_rig_driver.can_bus.can_hub', str(bus)))
        wait_until(bus.exists, 'the bus is there', START, processes)
        turned = [word for one in bench.turned for word in ('--set', one)]
        processes.start('emulated_rig', python(
            'servo_rig_driver.emulated.rig_process', '--rig', str(bench.rig), '--interface',
            'unix_bus', '--channel', str(bus), '--driver', str(bench.driver), *period, *turned,
            *(('--faults', str(faults)) if faults else ())))
    look_around(session, AT_FIRST, processes)  # while the rig loads, which is no node
    outlast(session, processes, say)
    # side by side: each loads for a second, and none needs another before the driver is configured
    processes.start('recorder', node(bench.namespace, 'servo_rig_driver.record.recorder_node', {
        'output': str(bag), 'servo_file': str(bench.servo), 'family': bench.family}))
    processes.start('twin', node(bench.namespace, 'servo_twin.nodes.twin_node', {
        'servo_file': str(bench.servo), 'mode': bench.mode}))
    processes.start('driver', node(bench.namespace, 'servo_rig_driver.driver.driver_node', driver,
                                   bench.driver), first=True)
    if bench.rig is not None:
        wait_until(lambda: f' on unix_bus {bus}' in processes.said('emulated_rig'),
                   'the emulated rig is on the bus', START, processes)
    wait_until(lambda: 'twin' in session.nodes(), 'the twin is there', START, processes)
    if not session.change('twin', CONFIGURE, START):
        raise ProcessError(f'the twin cannot be configured:\n{processes.tail("twin")}')
    # until here nothing of this run publishes what another in its namespace would take
    look_around(session, AT_LAST, processes, set(NODES) - {'player'})
    outlast(session, processes, say)
    processes.start('player', [
        *python('servo_rig_driver.record.player_node', bench.family), '--duration',
        str(bench.duration), '--wait', str(_PLAYER_WAITS), *_excitation(bench), '--ros-args',
        '-r', f'__ns:=/{bench.namespace}'], may_end=True)
    if not session.change('twin', ACTIVATE, START):
        raise ProcessError(f'the twin cannot be activated:\n{processes.tail("twin")}')
    if not session.change('driver', CONFIGURE, START):
        raise ProcessError(f'the driver cannot be configured: {_why(session)}\n'
                           f'{processes.tail("driver")}')
    for topic, readers in (('encoder', 3), ('torque', 2), ('current', 2)):
        wait_until(lambda topic=topic, readers=readers: session.heard('driver', topic, readers),
                   f'recorder, twin and player listen to {topic}', START, processes)
    for topic in ('twin/prediction', 'twin/residual'):
        wait_until(lambda topic=topic: session.heard('twin', topic, 1),
                   f'the recorder listens to {topic}', START, processes)
    if bench.page is not None:
        _show(bench, bench.page, faults, processes)
    wait_until(lambda: session.linked('command', 2), 'the player is there', START, processes)
    sleep(_SETTLE)
    say(processes.said('player').strip())
    refuse_taken(session, NODES)  # another that began in the same second
    if not session.change('driver', ACTIVATE, START):
        raise ProcessError(f'the driver cannot be activated: {_why(session)}')


def _show(bench: Bench, page: Page, faults: Path | None, processes: Processes) -> None:
    """Start the live view and say where it is."""
    processes.start('view', [
        *python('servo_twin.cli', 'view', '--namespace', bench.namespace, '--port',
                 str(page.port), '-o', str(bench.folder / 'answers')),
        *(('--control',) if page.control else ()),
        *(('--faults', str(faults)) if faults else ())])
    wait_until(lambda: 'http://' in processes.said('view'), 'the view listens', START, processes)
    print(processes.said('view').strip(), flush=True)


def _watch(bench: Bench, processes: Processes, session: Session, begin: float) -> None:
    """
    Show what happens until the player is done.

    Raises ProcessError where a process ends or a node stands still; the player is ended then.
    """
    title = f'{bench.family} on ' + ('a rig' if bench.rig is None else bench.rig.stem)
    console = Console(quiet=bench.quiet)
    told = looked = begin
    silences = Silences(NODES)

    def shown():
        return view(title, monotonic() - begin, bench.duration, session.facts, session.sentences,
                    session.levels)

    with Live(shown(), console=console, refresh_per_second=4, transient=True) as live:
        while processes.running('player'):
            processes.check()
            sleep(0.2)
            looked, before = monotonic(), looked
            still = silences.look(session.counts, looked - before)
            if still:
                processes.ask('player')
                raise ProcessError(f'{" and ".join(still)} stood still: not a word within '
                                   f'{SILENT:g} s; the run is ended')
            if console.is_terminal:
                live.update(shown())
            elif not bench.quiet and monotonic() - told > 5.0:
                told = monotonic()
                print(numbers(told - begin, session.facts), flush=True)
    processes.check()


def _take_down(session: Session, processes: Processes) -> None:
    """Stop sampling, let all samples be answered and written, then end the nodes."""
    session.change('driver', DEACTIVATE, 10.0)
    sleep(_SETTLE)
    if processes.running('twin'):
        session.change('twin', DEACTIVATE, 10.0)
    sleep(_REPORT)
    processes.stop('recorder')


def let_answer(processes: Processes) -> None:
    """Wait until a diagnosis that the page asked for has ended."""
    if not _diagnosing(processes):
        return
    print('waiting for the diagnosis that the page asked for; Ctrl-C ends it', flush=True)
    try:
        while _diagnosing(processes):
            sleep(0.2)
    except KeyboardInterrupt:
        return
    print(processes.said('view').strip().splitlines()[-1], flush=True)


def _diagnosing(processes: Processes) -> bool:
    said = processes.said('view')
    return processes.running('view') and said.count(BEGINS) > said.count(ENDS)


def _why(session: Session) -> str:
    """Return what is wrong with the driver, which it says shortly after it went wrong."""
    until = monotonic() + _REPORT
    while monotonic() < until and (not session.levels.get('driver')
                                   or _UNTOLD in session.sentences['driver']):
        sleep(0.02)
    return session.sentences.get('driver', 'it says nothing; see driver.log')


def _excitation(bench: Bench) -> list[str]:
    words = [word for setting in bench.settings for word in ('--setting', setting)]
    return words + (['--mode', bench.command] if bench.command else [])
