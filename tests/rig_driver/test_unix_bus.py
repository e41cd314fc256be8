"""The bus between processes: nothing lost, nothing echoed, garbage refused and counted."""

import os
from pathlib import Path
import signal
import socket
import subprocess
import sys
from time import monotonic_ns, sleep

import can
from hypothesis import given
from hypothesis import strategies as st
import pytest

from servo_rig_driver.can_bus import unix_frames as can_frames
from servo_rig_driver.can_bus.bus_opening import (
    BusError,
    BusSettings,
    open_bus,
    Wire,
)
from servo_rig_driver.can_bus.can_hub import CanHub
from servo_rig_driver.can_bus.unix_bus import UnixBus

PACKAGE = Path(can_frames.__file__).parents[2]
ECHO = """
import sys
from servo_rig_driver.can_bus.bus_opening import BusSettings, Wire, open_bus
wire = Wire(open_bus(BusSettings('unix_bus', sys.argv[1])))
wire.send([(0x701, bytes(1))])
while True:
    for identifier, data in wire.recv(10.0):
        if identifier == 0x7FF:
            sys.exit(0)
        wire.send([(identifier + 1, data)])
"""


def spawn(*arguments):
    environment = {**os.environ,
                   'PYTHONPATH': f'{PACKAGE}{os.pathsep}{os.environ.get("PYTHONPATH", "")}'}
    return subprocess.Popen([sys.executable, *arguments], env=environment, text=True,
                            stderr=subprocess.PIPE)


@pytest.fixture
def path(tmp_path):
    return str(tmp_path / 'can')


@pytest.fixture
def hub(path):
    with CanHub(path) as running:
        yield running


def opened(path, wait=10.0):
    return open_bus(BusSettings('unix_bus', path), wait)


def gather(wire, number):
    frames = []
    while len(frames) < number:
        some = wire.recv(5.0)
        assert some, f'{len(frames)} of {number} frames came'
        frames += some
    return frames


def gather_until(wire, identifier):
    frames = []
    while not frames or frames[-1][0] != identifier:
        some = wire.recv(5.0)
        assert some, f'{identifier:#x} did not come'
        frames += some
    return frames[:-1]


def test_frames_cross_three_processes_in_order_and_none_is_lost(path):
    hub = spawn('-m', 'servo_rig_driver.can_bus.can_hub', path)
    wire = Wire(opened(path))
    echo = spawn('-c', ECHO, path)
    assert gather(wire, 1) == [(0x701, bytes(1))]
    for k in range(20_000):
        wire.send([(0x100, k.to_bytes(4, 'little'))])
    answers = gather(wire, 20_000)
    assert [int.from_bytes(data, 'little') for _, data in answers] == list(range(20_000))
    wire.send([(0x7FF, b'')])
    assert echo.wait(60.0) == 0
    hub.send_signal(signal.SIGTERM)
    assert '0 refused, 0 too late, 0 clients let go' in hub.communicate(timeout=60.0)[1]
    wire.bus.shutdown()


def test_a_node_hears_all_others_and_never_itself(hub, path):
    wires = [Wire(opened(path)) for _ in range(3)]
    for k, wire in enumerate(wires):
        wire.send([(0x10 + k, bytes([k]))])
    for k, wire in enumerate(wires):
        heard = sorted(identifier for identifier, _ in gather(wire, 2))
        assert heard == [0x10 + other for other in range(3) if other != k]
        assert wire.recv(0.0) == []
        wire.bus.shutdown()


def test_what_has_expired_goes_back_to_its_sender_and_to_nobody_else(hub, path):
    here, there = Wire(opened(path)), Wire(opened(path))
    now, hour = monotonic_ns(), 3_600_000_000_000
    here.send([(0x201, b'\x01')], now - 1, tag=7)
    here.send([(0x201, b'\x02')], now + hour, tag=8)
    here.send([(0x202 | can_frames.FD, b'\x03')], now - 1, tag=9)
    here.send([(0x203, b'\x04')])
    assert gather(there, 2) == [(0x201, b'\x02'), (0x203, b'\x04')]
    assert here.recv(1.0) == here.recv(1.0) == []
    assert here.late() == [7, 9]
    assert (hub.passed, hub.late, hub.refused, here.late()) == (2, 2, 0, [])
    here.bus.shutdown()
    there.bus.shutdown()


def test_what_waited_for_a_client_until_it_was_too_late_is_left_out_for_that_one(hub, path):
    here, there, slow = (Wire(opened(path)) for _ in range(3))
    until, sent = monotonic_ns() + 3_000_000_000, 2000
    for k in range(sent):  # more than the system holds for one who does not read
        here.send([(0x201, k.to_bytes(4, 'little'))], until, tag=k)
        assert there.recv(5.0) == [(0x201, k.to_bytes(4, 'little'))]
    assert monotonic_ns() < until
    here.send([(0x203, b'')])
    while monotonic_ns() <= until:
        sleep(0.05)
    heard = gather_until(slow, 0x203)
    assert [int.from_bytes(data, 'little') for _, data in heard] == list(range(len(heard)))
    assert hub.overdue == sent - len(heard) > 0
    assert (hub.late, here.late(), hub.dropped) == (0, [], 0)
    for wire in (here, there, slow):
        wire.bus.shutdown()


def test_a_packet_of_the_wrong_length_is_refused_told_and_counted(hub, path, caplog):
    good, listener = Wire(opened(path)), Wire(opened(path))
    raw = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    raw.connect(path)
    raw.send(b'garbage')
    raw.send(can_frames.LAYOUT.pack(0x123, 9, bytes(8)))
    raw.send(can_frames.to_bytes(0x123, b'ok'))
    assert gather(listener, 1) == [(0x123, b'ok')]
    assert hub.refused == 2
    assert '7 bytes are no CAN frames' in caplog.text
    for wire in (good, listener):
        wire.bus.shutdown()
    raw.close()


def test_a_client_that_stops_reading_is_let_go_and_does_not_hold_up_the_others(
        hub, path, monkeypatch):
    monkeypatch.setattr('servo_rig_driver.can_bus.can_hub.BACKLOG', 100)
    sender, reader, sleeper = (Wire(opened(path)) for _ in range(3))
    for k in range(3000):
        sender.send([(0x100, k.to_bytes(4, 'little'))])
        gather(reader, 1)
    assert hub.dropped == 1
    with pytest.raises(can.CanOperationError, match='hub'):
        while True:
            sleeper.recv(5.0)
    for wire in (sender, reader, sleeper):
        wire.bus.shutdown()


def test_a_hub_that_goes_away_is_told_and_a_new_one_serves_again(path):
    with CanHub(path):
        wire = Wire(opened(path))
    with pytest.raises(can.CanOperationError, match='hub'):
        wire.recv(5.0)
    with pytest.raises(can.CanOperationError, match='hub'):
        for _ in range(3):
            wire.send([(1, b'')])
    wire.bus.shutdown()
    with CanHub(path):
        opened(path).shutdown()


def test_a_killed_hub_leaves_a_socket_that_the_next_one_takes_over(path):
    killed = spawn('-m', 'servo_rig_driver.can_bus.can_hub', path)
    opened(path).shutdown()
    killed.kill()
    killed.communicate(timeout=60.0)
    with CanHub(path):
        opened(path).shutdown()


def test_a_second_hub_on_the_same_path_is_refused(hub, path):
    with pytest.raises(OSError, match='another hub already serves'):
        CanHub(path)


def test_a_file_that_is_no_socket_is_left_as_it_is(tmp_path):
    file = tmp_path / 'servo.yaml'
    file.write_text('servo: mine')
    for place in (file, tmp_path):
        with pytest.raises(FileExistsError, match='is no socket, and no bus takes its place'):
            CanHub(str(place))
    assert file.read_text() == 'servo: mine'


def test_only_its_user_may_open_the_bus(hub, path):
    assert Path(path).stat().st_mode & 0o777 == 0o600


def test_the_hub_of_another_user_is_refused(hub, path, monkeypatch):
    monkeypatch.setattr('servo_rig_driver.can_bus.unix_bus.owner_of', lambda client: 4711)
    with pytest.raises(can.CanInitializationError, match='belongs to user 4711'):
        opened(path, 0.1)


def test_without_a_hub_the_error_says_how_to_start_one(path):
    with pytest.raises(can.CanError, match='python -m servo_rig_driver.can_bus.can_hub'):
        opened(path, wait=0.0)


def test_python_can_messages_keep_identifier_flags_and_data(hub, path):
    one, other = UnixBus(path), UnixBus(path, can_filters=[{'can_id': 0x18FF, 'can_mask': 0xFFFF}])
    one.send(can.Message(arbitration_id=0x123, data=b'x', is_extended_id=False))
    one.send(can.Message(arbitration_id=0x18FF, data=b'12345678', is_extended_id=True))
    message = other.recv(5.0)
    assert (message.arbitration_id, message.is_extended_id, bytes(message.data)) == (
        0x18FF, True, b'12345678')
    one.send(can.Message(arbitration_id=0x8001, data=bytes(range(48)), is_fd=True))
    one.send(can.Message(arbitration_id=0x29, is_extended_id=False, is_remote_frame=True))
    watching = UnixBus(path)
    one.send(can.Message(arbitration_id=0x18001, data=bytes(range(48)), is_fd=True))
    heard = watching.recv(5.0)
    while heard is not None and heard.arbitration_id == 0x29:  # it came as the hub was asked
        heard = watching.recv(5.0)
    assert (heard.is_fd, heard.bitrate_switch, heard.arbitration_id, bytes(heard.data)) == (
        True, True, 0x18001, bytes(range(48)))
    watching.shutdown()
    one.shutdown()
    other.shutdown()


@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), min_size=1,
                max_size=can_frames.MOST_FRAMES))
def test_packets_return_the_frames_they_were_made_of(frames):
    assert can_frames.from_bytes(b''.join(can_frames.to_bytes(*f) for f in frames)) == frames


@given(st.lists(st.tuples(st.integers(0, can_frames.EXTENDED_MASK),
                          st.sampled_from(can_frames.FD_SIZES)), min_size=1, max_size=56))
def test_packets_of_can_fd_return_the_frames_they_were_made_of(frames):
    frames = [(number | can_frames.FD | can_frames.EXTENDED, bytes([size] * size))
              for number, size in frames]
    assert can_frames.from_bytes(b''.join(can_frames.to_bytes(*f) for f in frames)) == frames


@given(st.binary(max_size=150))
def test_any_bytes_are_frames_or_refused(packet):
    try:
        frames = can_frames.from_bytes(packet)
    except can_frames.BadFrame:
        return
    assert len(packet) == sum(
        (can_frames.FD_LAYOUT if identifier & can_frames.FD else can_frames.LAYOUT).size
        for identifier, _ in frames)


def test_frames_of_both_kinds_cross_in_their_order(hub, path):
    one, other = Wire(opened(path)), Wire(opened(path))
    sent = [(0x123, b'a'), (0x8001 | can_frames.EXTENDED | can_frames.FD, bytes(64)),
            (0x29 | can_frames.REMOTE, b''), (0x12, b'b')]
    one.send(sent)
    assert gather(other, 4) == sent
    for wire in (one, other):
        wire.bus.shutdown()


def test_too_much_data_for_a_frame_is_refused():
    for identifier in (0x123, 0x123 | can_frames.FD):
        with pytest.raises(can_frames.BadFrame, match='9 data bytes'):
            can_frames.to_bytes(identifier, bytes(9))


@pytest.mark.parametrize('section, words', [
    ({'interface': 'udp'}, "bus.interface = 'udp' is unknown"),
    ({'channel': ''}, 'bus.channel is empty'),
    ({'bitrate': 1}, 'bitrate = 1'),
])
def test_a_wrong_bus_setting_is_named(section, words):
    with pytest.raises(BusError, match=words):
        BusSettings(**section)


def test_a_virtual_bus_speaks_the_same_way():
    wires = [Wire(open_bus(BusSettings('virtual', 'speaks'))) for _ in range(2)]
    wires[0].send([(0x80, b'\x01'), (0x181, bytes(8))])
    assert gather(wires[1], 2) == [(0x80, b'\x01'), (0x181, bytes(8))]
    for wire in wires:
        wire.bus.shutdown()


@pytest.mark.parametrize('unread', [50, 2000])  # in its socket; and in the hub as well
def test_what_a_client_said_last_arrives_though_it_left_unread_packets(tmp_path, unread):
    path = str(tmp_path / 'can')
    with CanHub(path):
        leaving, other = (UnixBus(path) for _ in range(2))
        for _ in range(unread):
            other.send_frames([(0x80, b'\0')])
        leaving.send_frames([(0x181, b'last')])
        leaving.shutdown()
        for _ in range(50):
            other.send_frames([(0x80, b'\0')])
        assert other.recv_frames(2.0) == [(0x181, b'last')]
        other.shutdown()


@pytest.fixture
def runtime(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    return tmp_path / 'servo_twin'


def test_a_bus_by_name_lies_where_only_its_user_comes(runtime):
    with CanHub('rig.can') as hub, Wire(open_bus(BusSettings('unix_bus', 'rig.can'))).bus:
        assert hub.path == runtime / 'rig.can'
        assert runtime.stat().st_mode & 0o7777 == 0o700
        assert hub.path.stat().st_mode & 0o7777 == 0o600


def test_a_folder_that_others_may_enter_is_refused(runtime):
    runtime.mkdir(mode=0o755)
    with pytest.raises(PermissionError, match='alone may enter'):
        CanHub('rig.can')


def test_a_link_in_place_of_the_folder_is_refused(runtime, tmp_path):
    (tmp_path / 'elsewhere').mkdir(mode=0o700)
    runtime.symlink_to(tmp_path / 'elsewhere')
    with pytest.raises(PermissionError, match='alone may enter'):
        CanHub('rig.can')


def test_no_default_names_a_place_that_another_user_may_take():
    assert '/' not in BusSettings().channel
    root = Path(__file__).resolve().parents[2]
    for path in [*root.glob('src/*/launch/*.yaml'), *root.glob('config/**/*.yaml')]:
        assert '/tmp/' not in path.read_text(), path
