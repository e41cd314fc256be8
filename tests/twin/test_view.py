"""The live view in a real browser: it ..."""

from http.client import HTTPConnection
import json
from pathlib import Path
import re
import signal
import socket
import subprocess
import sys
import time

from bench_recording import bench_recording, SERVO
from headless_chromium import Browser, found
import numpy as np
from page_labels import OVERLAPS, RECORD_LABELS
import pytest

from servo_twin.bag import write_predictions
from servo_twin.bringup.processes import wait_until
from servo_twin.cli import main
from servo_twin.description.servo_file import load
from servo_twin.lockstep.whole_recording import answer

pytestmark = [
    pytest.mark.slow, pytest.mark.skipif(not found(), reason='no browser is installed')]
UPGRADE = {'Connection': 'Upgrade', 'Upgrade': 'websocket', 'Sec-WebSocket-Version': '13',
           'Sec-WebSocket-Key': 'AAAAAAAAAAAAAAAAAAAAAA=='}


class ViewProcess:
    """`servo-twin view` with words, once it listens."""

    def __init__(self, *words: object, port: int = 0) -> None:
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'servo_twin.cli', 'view', '--port', str(port),
             *map(str, words)], stdout=subprocess.PIPE, text=True)
        self.said = self.process.stdout.readline()
        self.url = re.search(r'http://\S+', self.said)[0]
        self.port = int(self.url.rpartition(':')[2])

    def end(self, number: int = signal.SIGINT) -> int:
        """End it by a signal and return its exit status."""
        self.process.send_signal(number)
        return self.process.wait(60.0)


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    recording = bench_recording(12.0)
    path = tmp_path_factory.mktemp('view') / 'bench'
    return write_predictions(path, answer(recording, load(SERVO)), recording)


@pytest.fixture(scope='module')
def view(bag):
    process = ViewProcess(bag)
    yield process
    if process.process.poll() is None:
        process.end()


@pytest.fixture(scope='module')
def browser(tmp_path_factory):
    one = Browser(tmp_path_factory.mktemp('profile'))
    one.before_any_page(RECORD_LABELS)
    yield one
    one.close()


def ask(port: int, path: str = '/', **headers: str) -> tuple[int, dict[str, str]]:
    """Return status and headers of a request with headers of its own."""
    connection = HTTPConnection('127.0.0.1', port, timeout=5.0)
    connection.putrequest('GET', path, skip_host='Host' in headers)
    for name, value in headers.items():
        connection.putheader(name.replace('_', '-'), value)
    connection.endheaders()
    answered = connection.getresponse()
    connection.close()
    return answered.status, dict(answered.getheaders())


@pytest.mark.parametrize('width, dark', [(360, True), (1400, False)])
def test_it_plays_a_bag_with_rig_twin_and_residuals_and_loads_nothing_from_elsewhere(
        view, browser, width, dark):
    browser.open(view.url, width, 2400, dark)
    browser.until('buckets.count > 100 && '
                  'one("chain").querySelector(".far, .fine, .off") !== null')
    for name in ('load_position', 'twin.load_position', 'gap.torque', 'balance.load'):
        assert browser.run(f'buckets.known("{name}")'), name
    browser.until('spectrum.plot !== null && plots.length === 10')
    browser.settle()
    assert browser.run(OVERLAPS) == []
    assert browser.errors == []
    assert {url.replace('ws:', 'http:').startswith(view.url) or url.startswith('data:')
            for url in browser.requests} == {True}
    assert browser.run('one("badge").textContent') in ('playing a recording', 'paused')


def test_units_that_become_known_later_stand_over_the_plots_and_the_spectrum(view, browser):
    browser.open(view.url)
    browser.until('spectrum.plot !== null && plots.length === 10')
    heads = '[...document.querySelectorAll("#signals h2")].map(head => head.textContent)'
    assert browser.run(heads) == ['load position, rad', 'torque, N m']
    spoken = {'load_position': 'm', 'torque': 'N', 'balance.load': 'floors'}
    browser.run(f'parts.units({{...state.units, ...{json.dumps(spoken)}}})')
    assert browser.run(heads) == ['load position, m', 'torque, N']
    browser.until('one("spectrum").textContent.includes("floors / ")')


def test_what_it_draws_is_what_was_recorded(view, browser, bag):
    browser.open(view.url)
    browser.run('link.say({play: {at: 5.0, playing: false}})')
    browser.until('one("place").textContent.startsWith("5.0 of") && buckets.end > 4.9')
    first, step, low, high = browser.run(
        '[buckets.first, buckets.step, ...Object.values(buckets.bands.get("load_position"))]')
    recording = bench_recording(12.0)
    size = round(step / recording.period)
    samples = recording['load_position'][first * size:(first + len(low)) * size].reshape(-1, size)
    assert size > 1 and len(low) > 100
    assert np.array_equal(low, samples.min(axis=1).astype(np.float32))
    assert np.array_equal(high, samples.max(axis=1).astype(np.float32))
    browser.run('one("play").click()')
    browser.until('buckets.end > 5.2')


def test_it_is_read_only_unless_it_was_told(view, browser):
    browser.open(view.url)
    browser.until('!one("values-card").hidden')
    assert browser.run('[...document.querySelectorAll("#values input")].every(i => i.disabled)')
    browser.run('link.say({set: {path: "drive.gain", value: 0.3}})')
    assert '--control' in browser.until('!one("refused").hidden && one("refused").textContent')
    assert browser.run('one("faults-card").hidden')


@pytest.mark.parametrize('headers, status', [
    ({}, 200),
    ({'Host': 'localhost:{port}'}, 200),
    ({'Host': 'servo.example:{port}'}, 403),  # a name that was made to lead here
    ({'Host': '127.0.0.1'}, 403),
    ({'Origin': 'http://servo.example'}, 403),
    ({'Origin': 'null'}, 403),
    ({'Origin': 'https://127.0.0.1:{port}'}, 403),
])
def test_it_answers_pages_of_its_own_alone(view, headers, status):
    headers = {name: value.format(port=view.port) for name, value in headers.items()}
    for path in ('/', '/view.js', '/answers/1'):
        found, said = ask(view.port, path, **headers)
        assert found == (404 if path == '/answers/1' and status == 200 else status)
        assert 'Access-Control-Allow-Origin' not in said
    assert "default-src 'none'" in said['Content-Security-Policy']


@pytest.mark.parametrize('headers, status', [
    ({'Origin': 'http://127.0.0.1:{port}'}, 101),
    ({}, 403),
    ({'Origin': 'http://servo.example'}, 403),
    ({'Origin': 'http://127.0.0.1:1'}, 403),
    ({'Origin': 'http://127.0.0.1:{port}', 'Host': 'servo.example:{port}'}, 403),
])
def test_no_other_site_gets_a_socket(view, headers, status):
    headers = {name: value.format(port=view.port) for name, value in headers.items()}
    assert ask(view.port, '/socket', **UPGRADE, **headers)[0] == status


def test_it_listens_to_this_machine_alone(view):
    with pytest.raises(OSError):  # bound to all addresses, it would answer at this one as well
        socket.create_connection(('127.0.0.2', view.port), 1.0)


@pytest.mark.long
def test_a_page_goes_on_after_a_restart_of_the_server(bag, browser):
    first = ViewProcess(bag)
    browser.open(first.url)
    browser.until('buckets.count > 20')
    assert first.end() == 0
    browser.until('one("badge").textContent.includes("no connection")')
    browser.run('buckets.count = 0')
    second = ViewProcess(bag, port=first.port)
    browser.until('buckets.count > 20')
    assert second.end(signal.SIGTERM) == 0


def test_it_says_that_a_port_is_taken(view, bag, capsys):
    assert main(['view', str(bag), '--port', str(view.port)]) == 2
    assert f'--port {view.port} on 127.0.0.1 cannot be had' in capsys.readouterr().err


def test_it_ends_with_who_started_it(bag):
    parent = subprocess.Popen(
        [sys.executable, '-c', 'import subprocess, sys; subprocess.Popen(sys.argv[1:]).wait()',
         sys.executable, '-m', 'servo_twin.cli', 'view', str(bag), '--port', '0'],
        stdout=subprocess.PIPE, text=True)
    port = int(parent.stdout.readline().split()[1].rpartition(':')[2])
    parent.kill()
    until = time.monotonic() + 15.0
    while time.monotonic() < until:
        try:
            socket.create_connection(('127.0.0.1', port), 1.0).close()
        except OSError:
            break
        time.sleep(0.05)
    else:
        pytest.fail('it still listens')


def jobs(folder: Path) -> list[str]:
    """Return the processes of a diagnosis whose files lie below a folder."""
    found = []
    for entry in Path('/proc').glob('[0-9]*/cmdline'):
        try:
            line = entry.read_bytes().decode(errors='replace')
        except OSError:
            continue
        if 'diagnose_job' in line and str(folder) in line:
            found.append(line)
    return found


def test_a_diagnosis_ends_with_its_view_even_where_that_is_killed(bag, browser, tmp_path):
    view = ViewProcess(bag, '-o', tmp_path)
    browser.open(view.url)
    browser.until('buckets.count > 20')
    browser.run('link.say({play: {at: 11.0, playing: false}})')
    browser.run('one("diagnose").click()')
    wait_until(lambda: jobs(tmp_path), 'the diagnosis runs', 90.0)
    view.end(signal.SIGKILL)
    wait_until(lambda: not jobs(tmp_path), 'the diagnosis has ended', 20.0)


def test_faults_without_control_are_refused(capsys):
    assert main(['view', '--faults', '/nowhere']) == 2
    assert '--faults needs --control' in capsys.readouterr().err
