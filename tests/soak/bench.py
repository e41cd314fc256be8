"""The processes of the soak: rig, two hubs with the proxy between, driver, twin, recorder."""

from __future__ import annotations

from contextlib import suppress
import json
import os
from pathlib import Path
import resource
import signal
import subprocess
import sys

from answers import Answers
from stepped_clock import SteppedClock

HERE = Path(__file__).resolve().parent
CONFIG = HERE.parents[1] / 'config'


class Bench:
    """Starts, hurts and starts again; every bag of the recorder has a folder of its own."""

    def __init__(self, folder: Path, identify: bool, namespace: str = 'rig') -> None:
        self.folder, self.namespace, self.identify = folder, namespace, identify
        self.running: dict[str, subprocess.Popen] = {}
        self.ended: list[tuple[str, int]] = []
        self.bags: list[Path] = []
        (folder / 'logs').mkdir(parents=True, exist_ok=True)
        self.clock = SteppedClock(folder)

    @property
    def names(self) -> list[str]:
        """What there is, in the order of the start."""
        return ['rig_hub', 'driver_hub', 'emulated_rig', 'proxy', 'recorder', 'twin',
                *(['identify'] if self.identify else []), 'driver']

    @property
    def faults(self) -> Path:
        """The socket by which the emulated rig is changed, see fault_port.py."""
        return self.folder / 'faults'

    def start(self, name: str) -> None:
        """Start a process of the bench."""
        rig, driver = str(self.folder / 'rig.can'), str(self.folder / 'driver.can')
        servo = str(CONFIG / 'servos' / 'rv_bench.yaml')
        python = [sys.executable, '-m']
        match name:
            case 'rig_hub' | 'driver_hub':
                command = [*python, 'servo_rig_driver.can_bus.can_hub',
                           rig if name == 'rig_hub' else driver]
            case 'emulated_rig':
                command = [*python, 'servo_rig_driver.emulated.rig_process', '--rig',
                           str(CONFIG / 'rigs' / 'rv_bench.yaml'), '--interface', 'unix_bus',
                           '--channel', rig, '--faults', str(self.faults)]
                self.faults.unlink(missing_ok=True)  # of one that was killed
            case 'proxy':
                command = [sys.executable, str(HERE / 'wire_proxy.py'), rig, driver,
                           str(self.folder / 'bus.log'), str(self.folder / 'answers.log')]
            case 'recorder':
                self.bags.append(self.folder / 'bags' / f'bag_{len(self.bags):03d}')
                command = self.node('servo_rig_driver.record.recorder_node',
                                    output=self.bags[-1], servo_file=servo)
            case 'twin':
                command = self.node('servo_twin.nodes.twin_node', servo_file=servo,
                                    autostart='true')
            case 'identify':
                command = self.node('servo_identify.nodes.identify_node', servo_file=servo,
                                    folder=self.folder / 'retrained')
            case 'driver':
                command = self.node('servo_rig_driver.driver.driver_node',
                                    CONFIG / 'driver.yaml', autostart='true', **{
                                        'bus.interface': 'unix_bus', 'bus.channel': driver,
                                        'block_size': 10, 'retry_period': 0.2,
                                        'enable_after_loss': 'true'})
        log = (self.folder / 'logs' / f'{name}.log').open('ab')
        self.running[name] = subprocess.Popen(
            command, stdin=subprocess.PIPE if name == 'proxy' else subprocess.DEVNULL, stdout=log,
            stderr=subprocess.STDOUT, start_new_session=True, text=name == 'proxy',
            # the proxy is a witness; all end with the soak, as with `servo-twin run`
            env=os.environ | {'SERVO_PARENT': str(os.getpid())} | (
                {} if name == 'proxy' else self.clock.environment))

    def node(self, module: str, file: Path | None = None, **values: object) -> list[str]:
        """Return the command of a node in the namespace of the rig."""
        command = [sys.executable, '-m', module, '--ros-args', '-r', f'__ns:=/{self.namespace}']
        command += ['--params-file', str(file)] if file else []
        return command + [word for key, value in values.items()
                          for word in ('-p', f'{key}:={value}')]

    def wire(self, mode: str, **values: object) -> None:
        """Tell the proxy what to do with the frames."""
        proxy = self.running['proxy'].stdin
        proxy.write(json.dumps({'mode': mode, **values}) + '\n')
        proxy.flush()

    def spare(self, name: str, more: int | None) -> None:
        """Let a process have so many bytes more than it has, or None: any number."""
        child = self.running[name]
        if child.poll() is None:
            held = int(Path(f'/proc/{child.pid}/statm').read_text().split()[0])
            most = resource.RLIM_INFINITY if more is None else (
                held * resource.getpagesize() + more)
            with suppress(ProcessLookupError):
                resource.prlimit(child.pid, resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))

    def signal(self, name: str, number: int) -> None:
        """Send a signal; a process that has gone is left so."""
        if self.running[name].poll() is None:
            self.running[name].send_signal(number)

    def ended_by(self, name: str, patience: float = 15.0) -> None:
        """Wait until a process that was told to end has ended."""
        with suppress(subprocess.TimeoutExpired):
            self.running[name].wait(patience)

    def mend(self) -> list[str]:
        """Start what has ended again, as a service manager does; return the names."""
        gone = []
        for name in self.names:
            status = self.running[name].poll()
            if status is not None:
                self.ended.append((name, status))
                self.start(name)
                gone.append(name)
        return gone

    def pids(self) -> dict[str, int]:
        """Return the ids of what runs."""
        return {name: child.pid for name, child in self.running.items() if child.poll() is None}

    def close(self) -> list[str]:
        """End all in the reverse order of the start; return what had to be killed."""
        killed = []
        for name in reversed(self.names):
            child = self.running.get(name)
            if child is None:
                continue
            self.signal(name, signal.SIGCONT)
            if name == 'proxy':
                child.stdin.close()
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
                if child.poll() is not None:
                    break
                child.send_signal(number)
                try:
                    child.wait(15.0)
                except subprocess.TimeoutExpired:
                    killed += [name] if number == signal.SIGTERM else []
        return killed

    def answers(self) -> Answers:
        """Return what the load encoder answered on the driver's bus."""
        return Answers.read(self.folder / 'answers.log')

    def left(self) -> list[str]:
        """Return the command lines of processes that still know this folder."""
        found = []
        for entry in Path('/proc').iterdir():
            if not entry.name.isdigit() or int(entry.name) == os.getpid():
                continue
            try:
                words = (entry / 'cmdline').read_bytes().replace(b'\0', b' ').decode()
            except OSError:
                continue
            if str(self.folder) in words:
                found.append(words.strip())
        return found
