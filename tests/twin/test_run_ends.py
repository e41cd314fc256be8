"""`servo-twin run` is cut off anywhere: the drive loses its torque, and no process lives on."""

from contextlib import contextmanager
import fcntl
import itertools
import os
from pathlib import Path
import pty
import signal
import subprocess
import sys
import termios
from threading import Thread
from time import monotonic

from can_watcher import CanWatcher, ENABLED
from driver_bench import alive, CONFIG, Listener, wait_for
from held_up import held_up_since, watch
import pytest

from servo_twin.bringup.silences import MOST, Silences, SILENT

pytestmark = pytest.mark.ros

WATCHDOG = 1.0  # s; a busy machine stands still for longer than a drive's usual 0.1 s
SEEN_WITHIN = 1.5  # s until `run` has seen that a process is gone, and has ended the player
DOWN_WITHIN = 2.0  # s: quick stop 0.5, torque away 0.8, and a busy machine
STARTS = 60.0
GONE_WITHIN = 60.0
PROCESSES = ('can_hub', 'emulated_rig', 'driver', 'twin', 'recorder', 'player', 'view')
MODULES = {'can_hub': 'can_bus.can_hub', 'emulated_rig': 'rig_process', 'driver': 'driver_node',
           'twin': 'twin_node', 'recorder': 'recorder_node', 'player': 'player_node',
           'view': 'servo_twin.cli view'}
_numbers = itertools.count()
FAILED = 'the drive failed with error 8700h'  # its watchdog: no SYNC


class Run:
    """A run in a terminal of its own, its children, and one who looks at its bus."""

    def __init__(self, folder, view):
        self.namespace = f'ended{next(_numbers)}'  # who was killed stays in the graph for a while
        self.folder, self.ears = folder / 'bench', Listener(self.namespace, commands=False)
        driver = folder / 'driver.yaml'
        driver.write_text(CONFIG.read_text().replace('watchdog: 0.1 ', f'watchdog: {WATCHDOG} ')
                          .replace('heartbeat_timeout: 0.5 ', 'heartbeat_timeout: 3.0 '))
        self.shown = ''
        self.terminal, inside = pty.openpty()
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'servo_twin.cli', 'run', '--duration', '60', '--namespace',
             self.namespace, '--driver', str(driver), '--rig', 'rv_bench', '-o', str(self.folder),
             *(['--view', '--control', '--port', '0'] if view else [])],
            stdin=inside, stdout=inside, stderr=inside, start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
        os.close(inside)
        Thread(target=self._read, daemon=True).start()
        self.names = MODULES.keys() - (set() if view else {'view'})
        self.pids, self.watcher = {}, None

    def _read(self):
        try:
            while said := os.read(self.terminal, 4096):
                self.shown += said.decode(errors='replace')
        except OSError:
            return

    def turns(self):
        """Wait until the motor turns."""
        wait_for(lambda: self.names <= self._children().keys(), 'all have started', STARTS)
        self.pids = {name: pid for name, (pid, _) in self._children().items()}
        for pid in (*self.pids.values(), self.process.pid):
            watch(pid)
        self.watcher = CanWatcher(self._children()['can_hub'][1][-1])
        wait_for(lambda: self.watcher.states[-1:] == [ENABLED], 'the drive is enabled', STARTS)
        wait_for(lambda: self.ears.encoder and abs(self.ears.encoder[-1].motor_position[-1]
                                                   - self.ears.encoder[0].motor_position[0]) > 5.0,
                 'the motor turns')
        self.watcher.forget()

    def _children(self):
        """Return process id and command line of each child, by name."""
        found = {}
        for entry in Path('/proc').iterdir():
            try:
                parent = (entry / 'stat').read_text().rpartition(')')[2].split()[1]
                words = (entry / 'cmdline').read_bytes().decode().strip('\0').split('\0')
            except (OSError, IndexError, UnicodeDecodeError):
                continue
            name = next((name for name, module in MODULES.items()
                         if parent == str(self.process.pid) and module in ' '.join(words)), None)
            if name:
                found[name] = int(entry.name), words
        return found

    def said(self, name):
        """Return what a child has said."""
        return (self.folder / 'logs' / f'{name}.log').read_text(errors='replace')

    def left(self):
        """Return the names of those that live on."""
        return [name for name, pid in [*self.pids.items(), ('run', self.process.pid)]
                if alive(pid)]

    def close(self):
        """End what a failed test has left."""
        if self.watcher is not None:
            self.watcher.close()
        self.ears.close()
        for pid in [*self.pids.values(), self.process.pid]:
            if alive(pid):
                os.kill(pid, signal.SIGKILL)
        self.process.wait(60.0)


@contextmanager
def running(folder, view=True):
    run = Run(folder, view)
    try:
        run.turns()
        yield run
    finally:
        run.close()


@pytest.mark.long
@pytest.mark.parametrize('cut', [*PROCESSES, 'run', 'terminal'])
def test_the_drive_has_no_torque_and_nothing_lives_on_whatever_is_cut_off(tmp_path, cut):
    with running(tmp_path, cut in ('view', 'run', 'terminal')) as run:
        since = monotonic()
        if cut == 'terminal':
            os.close(run.terminal)
        else:
            os.kill(run.process.pid if cut == 'run' else run.pids[cut], signal.SIGKILL)
        if cut in ('can_hub', 'driver'):  # the drive has nobody left but itself
            wait_for(lambda: FAILED in run.said('emulated_rig'), 'the drive fails by itself')
            assert monotonic() - since < WATCHDOG + DOWN_WITHIN + held_up_since(since)
        elif cut != 'emulated_rig':
            run.watcher.saw_it_go_down(since, SEEN_WITHIN + DOWN_WITHIN, turns=False)
        run.watcher.close()
        run.process.wait(GONE_WITHIN)
        wait_for(lambda: not run.left(), f'all have ended, but {run.left()}', GONE_WITHIN)
        assert 'Traceback' not in ''.join(run.said(name) for name in run.names)


@pytest.mark.long
def test_ctrl_z_takes_the_drive_down_at_once_though_the_player_hangs(tmp_path):
    with running(tmp_path) as run:
        os.kill(run.pids['player'], signal.SIGSTOP)
        since = monotonic()
        os.write(run.terminal, b'\x1a')
        run.watcher.saw_it_go_down(since, DOWN_WITHIN, turns=False)
        os.kill(run.pids['player'], signal.SIGCONT)
        # the run itself goes on to tell what it has recorded
        wait_for(lambda: run.left() == ['run'], 'the others have ended', GONE_WITHIN)


@pytest.mark.long
@pytest.mark.parametrize('hung', ['driver', 'twin', 'player'])
def test_it_ends_where_a_node_stands_still_and_says_which(tmp_path, hung):
    with running(tmp_path, view=False) as run:
        since = monotonic()
        os.kill(run.pids[hung], signal.SIGSTOP)
        if hung == 'driver':  # the drive has nobody left but itself
            wait_for(lambda: FAILED in run.said('emulated_rig'), 'the drive fails by itself')
        else:
            run.watcher.saw_it_go_down(since, SILENT + 1.0 + DOWN_WITHIN, turns=False)
        run.watcher.close()
        assert run.process.wait(GONE_WITHIN) == 1
        wait_for(lambda: not run.left(), f'all have ended, but {run.left()}', GONE_WITHIN)
        assert f'{hung} stood still: not a word within {SILENT:g} s' in ' '.join(run.shown.split())


def test_a_silence_counts_only_while_somebody_listens():
    silences = Silences(('driver', 'twin'))
    heard = {'driver': 1, 'twin': 1}
    assert silences.look(heard, 0.2) == []
    for _ in range(round(SILENT / MOST) - 1):
        assert silences.look(heard, 60.0) == []  # stopped itself
    heard['twin'] = 2
    assert [silences.look(heard, 0.4) for _ in range(2)] == [[], ['driver']]
