"""The live view beside a running twin and an emulated rig, in a real browser: it ..."""

from contextlib import contextmanager
from pathlib import Path
import subprocess
import sys
from threading import Event, Thread
import time

from headless_chromium import Browser, found
import pytest
from rcl_interfaces.srv import GetParameters
import rclpy
from test_view import ViewProcess
from twin_graph import samples

from servo_twin.bringup.processes import wait_until
from servo_twin.description.servo_file import dumps, load, loads
from servo_twin.nodes.message_conversion import to_time
from servo_twin.nodes.twin_node import EVENTS
from servo_twin.view.live_rig import LiveRig
from servo_twin_msgs.msg import Event as EventMessage

pytestmark = [
    pytest.mark.ros, pytest.mark.slow,
    pytest.mark.skipif(not found(), reason='no browser is installed')]
RIG_FILE = Path(__file__).resolve().parents[2] / 'config' / 'rigs' / 'rv_plain.yaml'
BLOCK = 20


class Feeder:
    """Publishes blocks of a rig that stands still at its pace, on a thread, until it is ended."""

    def __init__(self, rig) -> None:
        self._rig, self._over, self.next = rig, Event(), 0
        self._thread = Thread(target=self._feed)
        self._thread.start()

    def _feed(self) -> None:
        while not self._over.wait(BLOCK * 1e-3):
            self._rig.say(self.next, samples(BLOCK))
            self.next += BLOCK

    def end(self) -> None:
        self._over.set()
        self._thread.join()


@pytest.fixture
def faulty_rig(tmp_path):
    """The socket by which faults of an emulated rig on a bus of its own are switched."""
    bus, faults = tmp_path / 'can', tmp_path / 'faults'
    hub = subprocess.Popen([sys.executable, '-m', 'servo_rig_driver.can_bus.can_hub', str(bus)])
    rig = subprocess.Popen([
        sys.executable, '-m', 'servo_rig_driver.emulated.rig_process', '--rig', str(RIG_FILE),
        '--channel', str(bus), '--faults', str(faults)], stderr=subprocess.DEVNULL)
    yield faults
    for process in (rig, hub):
        process.terminate()
        process.wait(60.0)


@pytest.mark.long
def test_it_follows_a_rig_moves_values_and_switches_faults(
        graph, faulty_rig, tmp_path):
    rig = graph('rig').ready()
    events = rig.node.create_publisher(EventMessage, '/rig/events', EVENTS)
    view = ViewProcess('--control', '--faults', faulty_rig)
    feeder, browser = Feeder(rig), Browser(tmp_path / 'profile')
    try:
        time.sleep(1.0)
        assert rig.node.count_subscribers('/rig/encoder') == 1  # nobody looks: the twin alone
        browser.open(view.url)
        browser.until('buckets.count > 20 && buckets.known("twin.load_position") '
                      '&& buckets.known("balance.load")')
        assert rig.node.count_subscribers('/rig/encoder') == 2
        browser.until('one("chain").children[4].className === "far"')
        assert browser.run('one("badge").textContent') == 'live'

        # a slider moves the parameter, and what is refused is said
        browser.until('document.querySelector("[data-path=\'drive.gain\'] input") !== null')
        browser.run("""(() => {
          const row = document.querySelector('[data-path="drive.gain"]');
          const slider = row.querySelector('[type=range]');
          slider.value = 0.5;
          slider.dispatchEvent(new Event('input'));
        })()""")
        shown = browser.run('+document.querySelector("[data-path=\'drive.gain\'] [type=number]")'
                            '.value')
        assert shown != 0.49

        def gain() -> float:
            answer = rig.ask(GetParameters, 'twin/get_parameters',
                             GetParameters.Request(names=['drive.gain']))
            return answer.values[0].double_value

        wait_until(lambda: gain() == shown, 'the twin has the value of the slider', 60.0)
        browser.run('link.say({set: {path: "drive.gain", value: 1e9}})')
        assert 'gain' in browser.until('!one("refused").hidden && one("refused").textContent')
        browser.until('state.events.some(e => e.kind === "parameters" && e.at > 0)')

        # events of others as well, at their time
        event = EventMessage(source='/rig/driver', kind='trouble', text='the drive is in fault')
        event.header.stamp = to_time(10**18 + feeder.next * 1_000_000)
        events.publish(event)
        browser.until('one("events").textContent.includes("the drive is in fault")')

        # faults of the emulated rig
        gravity = 'document.querySelector("[data-path=\'withheld.gravity\'] [role=switch]")'
        browser.until(f'{gravity} !== null')
        assert not browser.run(f'{gravity}.checked')
        browser.run(f'{gravity}.click()')
        browser.until('faults.latest.faults.find(f => f.path === "withheld.gravity").value === 4')
        browser.run('link.say({fault: {path: "friction.level", value: 2}})')
        browser.until('one("refused").textContent.includes("there is no fault")')

        # another run of the driver: numbers begin again
        feeder.end()
        feeder = Feeder(rig)
        browser.until('buckets.count > 5 && buckets.end < 8')
        assert browser.errors == []

        # nobody looks any more
        browser.open('about:blank')
        wait_until(lambda: rig.node.count_subscribers('/rig/encoder') == 1,
                   'the samples pass by', 60.0)
    finally:
        feeder.end()
        browser.close()
        assert view.end() == 0


@contextmanager
def looked_at(rig, monkeypatch):
    """Give what a view hears of a twin, once that has told its values and its servo."""
    rig.ready()
    live = LiveRig('rig')
    try:
        wait_until(lambda: live.servo() is not None, 'the twin has told its values', 60.0)
        yield live
    finally:
        with monkeypatch.context() as patched:
            patched.setattr(rclpy, 'try_shutdown', lambda: None)  # the graph still needs it
            live.close()


def test_it_knows_the_servo_that_the_twin_runs(graph, monkeypatch):
    with looked_at(graph('rig'), monkeypatch) as live:
        assert live.servo().name == live.facts()['status']['servo'] != ''
        assert live.servo() is live.servo()


def test_it_diagnoses_the_servo_that_runs_though_its_file_was_changed(
        graph, servo_files, monkeypatch):
    file, rig = servo_files / 'bench.yaml', graph('rig')
    before = file.read_text()
    with looked_at(rig, monkeypatch) as live:
        live.look(True)
        feeder = Feeder(rig)
        try:
            wait_until(lambda: live.traces.period and live.traces.end > 6.0 / live.traces.period,
                       'enough samples are there', 60.0)
            file.write_text(before.replace('effects:', 'effects:\n  seal: {effect: '
                                           'viscous_friction, at: load, slope: 9.0}'))
            assert 'effects.seal.slope' in load(file).values
            assert live.recording(60.0).servo_file == dumps(loads(before))
        finally:
            feeder.end()
            file.write_text(before)


@pytest.mark.long
def test_a_diagnosis_says_what_it_takes_and_can_be_ended(graph, tmp_path):
    rig = graph('rig').ready()
    view = ViewProcess()
    feeder, browser = Feeder(rig), Browser(tmp_path / 'profile')
    try:
        browser.open(view.url)
        browser.until('!one("values-card").hidden && buckets.count > 5')
        browser.run('one("diagnose").click()')
        said = browser.until('!one("answer").hidden && one("answer").textContent')
        assert 'takes at least 5 s' in said or browser.run('state.kept') > 5  # a busy machine
        browser.until('state.kept > 6')
        browser.run('one("diagnose").click()')
        browser.until('!one("cancel").hidden')
        browser.run('one("cancel").click()')
        browser.until('!one("answer").hidden && one("answer").textContent === "cancelled"')
        assert browser.errors == []
    finally:
        feeder.end()
        browser.close()
        assert view.end() == 0
