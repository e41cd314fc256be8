"""The emulated rig's nodes: CANopen, CiA 402, watchdogs, and the same data as without a bus."""

from pathlib import Path

import numpy as np
import pytest

from servo_rig_driver.devices.pdo_table import load_frames, sync_counter, sync_frame
from servo_rig_driver.emulated.canopen_nodes import RigNodes
from servo_rig_driver.emulated.emulated_bench import Bench, run
from servo_rig_driver.emulated.rig_file import load_rig

RIG = Path(__file__).parents[2] / 'config' / 'rigs' / 'rv_bench.yaml'
TABLE = load_frames()
START = (0x000, bytes([1, 0]))


class Master:
    """Talks to the nodes without a bus, sample by sample, with a clock of its own."""

    def __init__(self, rig=None):
        self.heard = []
        self.bench = Bench(rig or load_rig(RIG), seed=5)
        self.nodes = RigNodes(self.bench, TABLE, self.heard.extend)
        self.now = 0.0
        self.sample = 0

    def send(self, *frames):
        for identifier, data in frames:
            self.nodes.take(identifier, data, self.now)

    def command(self, name, *values):
        self.send((TABLE[name].cob_id, TABLE[name].pack(values)))

    def sync(self):
        """Send one SYNC; return the answers by frame name."""
        self.heard.clear()
        self.send(sync_frame(self.sample))
        self.sample += 1
        self.now += 1e-3
        return {TABLE.by_id[identifier].name: TABLE.by_id[identifier].decode(data)
                for identifier, data in self.heard if identifier in TABLE.by_id}

    def status(self):
        return self.sync()['drive.tpdo2']['statusword'] & 0x6F

    def enable(self, mode=9):
        self.send(START)
        for word in (0x06, 0x07, 0x0F):
            self.command('drive.rpdo1', word, mode)
            self.sync()
        assert self.status() == 0x27


@pytest.fixture
def master():
    return Master()


def test_nodes_announce_themselves_and_send_nothing_before_they_are_started(master):
    master.nodes.boot()
    assert master.heard == [(0x701, b'\0'), (0x702, b'\0'), (0x703, b'\0')]
    assert master.sync() == {}
    master.send(START)
    assert set(master.sync()) == {name for name, frame in TABLE.items()
                                  if frame.transmitted and frame.transmission_type == 1}


def test_samples_name_the_sync_that_they_answer(master):
    master.send(START)
    for k in range(500):
        answers = master.sync()
        for name in ('drive.tpdo2', 'load_encoder.tpdo1', 'torque_sensor.tpdo1'):
            assert answers[name]['sample_counter'] == sync_counter(k)
        assert ('torque_sensor.tpdo2' in answers) == (k % 10 == 9)


def test_the_drive_climbs_through_cia_402_to_operation_enabled(master):
    master.send(START)
    assert master.status() == 0x40
    for word, state in ((0x06, 0x21), (0x07, 0x23), (0x0F, 0x27), (0x07, 0x23), (0x0F, 0x27),
                        (0x06, 0x21), (0x0F, 0x27), (0x00, 0x40), (0x0F, 0x40)):
        master.command('drive.rpdo1', word, 9)
        assert master.status() == state


def test_a_drive_that_is_not_enabled_moves_nothing(master):
    master.send(START)
    master.command('drive.rpdo1', 0x06, -1)
    for _ in range(100):
        master.command('drive.rpdo2', 3.0, 0.0)
        answers = master.sync()
    assert answers['drive.tpdo3']['applied_voltage'] == 0.0
    assert abs(answers['drive.tpdo1']['position_actual_value']) < 1e-3


@pytest.mark.parametrize('mode, frame, value, channel, expected', [
    (-1, 'drive.rpdo2', (1.5, 0.0), 'applied_voltage', 1.5),
    (-2, 'drive.rpdo2', (0.0, 0.98), 'applied_voltage', 2.0),  # 0.98 A / 0.49 A/V
])
def test_a_command_takes_effect_at_the_next_sync(master, mode, frame, value, channel, expected):
    master.enable(mode)
    master.command(frame, *value)
    answers = master.sync()['drive.tpdo3']
    assert answers[channel] == pytest.approx(expected, abs=1e-6)
    assert answers['current_reference'] == pytest.approx(0.49 * expected, abs=1e-6)


def test_torque_mode_takes_its_target_in_thousandths_of_the_rated_torque(master):
    master.enable(10)
    master.send((0x601, bytes([0x2B, 0x71, 0x60, 0]) + (100).to_bytes(4, 'little')))
    answers = master.sync()['drive.tpdo3']
    # 0.1 * 2.39 N m / 0.4878 N m/A
    assert answers['current_reference'] == pytest.approx(0.48995, abs=1e-5)


def test_a_voltage_drive_refuses_modes_that_need_a_current_loop():
    master = Master(load_rig(RIG.parent / 'geared_dc.yaml'))
    master.enable(-1)
    for mode in (-2, 10, 3):
        master.command('drive.rpdo1', 0x0F, mode)
        assert master.sync()['drive.tpdo2']['modes_of_operation_display'] == -1


def test_velocity_and_position_are_followed(master):
    master.enable(9)
    for _ in range(800):
        master.command('drive.rpdo3', 0.2)
        answers = master.sync()
    assert answers['drive.tpdo1']['velocity_actual_value'] == pytest.approx(0.2 * 161, rel=0.1)
    master.command('drive.rpdo1', 0x0F, 8)
    for _ in range(2000):
        master.command('drive.rpdo4', 0.3)
        answers = master.sync()
    assert answers['load_encoder.tpdo1']['position_value'] == pytest.approx(0.3, abs=2e-3)


def test_position_mode_without_a_target_holds_where_it_is(master):
    master.enable(9)
    for _ in range(500):
        master.command('drive.rpdo3', 0.3)
        master.sync()
    master.command('drive.rpdo1', 0x0F, 8)
    before = master.sync()['load_encoder.tpdo1']['position_value']
    for _ in range(40):
        after = master.sync()['load_encoder.tpdo1']['position_value']
    assert abs(after - before) < 0.05


def test_external_torque_reaches_the_load_and_is_read_back(master):
    master.enable(9)
    for _ in range(500):
        master.command('drive.rpdo3', 0.0)
        master.command('torque_sensor.rpdo1', 30.0)
        answers = master.sync()
    assert answers['torque_sensor.tpdo1']['external_torque'] == pytest.approx(30.0, abs=0.1)
    assert answers['torque_sensor.tpdo1']['transmitted_torque'] > 5.0


def test_without_set_points_the_drive_stops_with_an_emergency(master):
    master.enable(-1)
    master.command('drive.rpdo2', 2.0, 0.0)
    emergencies = []
    for _ in range(60):
        answers = master.sync()
        emergencies += [data for identifier, data in master.heard if identifier == 0x81]
    assert emergencies == [bytes.fromhex('5082 01 0000000000')]
    assert answers['drive.tpdo2']['statusword'] & 0x4F == 0x08
    assert answers['drive.tpdo3']['applied_voltage'] == 0.0


def test_a_fault_is_left_by_a_rising_edge_only(master):
    master.enable()
    master.send((0x601, bytes([0x2B, 0x11, 0x20, 0]) + (0x2310).to_bytes(4, 'little')))
    assert (0x81, bytes.fromhex('1023 01 0000000000')) in master.heard
    for word, state in ((0x0F, 0x08), (0x80, 0x40), (0x06, 0x21)):
        master.command('drive.rpdo1', word, 9)
        assert master.status() & 0x6F == state
    master.send((0x601, bytes([0x40, 0x3F, 0x60, 0, 0, 0, 0, 0])))
    assert master.heard[-1][1][4:6] == bytes(2)


def test_sync_that_stops_is_a_fault_and_the_rig_comes_to_rest(master):
    master.enable(9)
    for _ in range(500):
        master.command('drive.rpdo3', 0.5)
        master.sync()
    for _ in range(100):
        master.now += 0.05
        master.nodes.tick(master.now)
    assert master.status() & 0x4F == 0x08
    assert abs(master.sync()['drive.tpdo1']['velocity_actual_value']) < 1.0


def test_quick_stop_brakes_and_then_switches_off(master):
    master.enable(9)
    for _ in range(500):
        master.command('drive.rpdo3', 0.5)
        master.sync()
    master.command('drive.rpdo1', 0x02, 9)
    assert master.status() == 0x07
    states = [master.status() for _ in range(600)]
    assert states[-1] == 0x40
    assert abs(master.sync()['drive.tpdo1']['velocity_actual_value']) < 0.5


def test_leaving_nmt_operational_switches_the_drive_off(master):
    master.enable()
    master.send((0x000, bytes([0x80, 1])))
    assert 'drive.tpdo2' not in master.sync()
    master.send(START)
    assert master.status() == 0x40


def test_heartbeats_come_at_the_interval_of_the_dictionary_and_follow_it(master):
    def beats(seconds):
        master.heard.clear()
        for _ in range(round(seconds * 100)):
            master.now += 0.01
            master.nodes.tick(master.now)
        return [data for identifier, data in master.heard if identifier == 0x701]
    beats(0.2)
    assert len(beats(1.0)) == pytest.approx(10, abs=1)
    assert beats(0.2)[0] == b'\x7f'
    master.send((0x601, bytes([0x2B, 0x17, 0x10, 0]) + (500).to_bytes(4, 'little')), START)
    assert len(beats(2.0)) == pytest.approx(4, abs=1)
    assert beats(1.0)[0] == b'\x05'


@pytest.mark.parametrize('identifier, size', [(0x201, 2), (0x301, 4), (0x401, 8), (0x203, 5)])
def test_a_frame_of_the_wrong_length_is_refused_told_and_changes_nothing(master, identifier, size,
                                                                         caplog):
    master.enable(9)
    master.send((identifier, bytes([0xFF] * size)))
    assert master.nodes.refused == 1
    assert f'0x{identifier:03X}' in caplog.text and f'has {size} bytes' in caplog.text
    assert (0x81, bytes.fromhex('1082 00 0000000000')) in master.heard
    assert master.status() == 0x27


def test_sync_and_nmt_of_the_wrong_length_are_refused(master):
    master.send(START, (0x080, bytes(2)), (0x000, bytes(1)), (0x000, bytes([99, 0])))
    assert master.nodes.refused == 3
    assert master.nodes.syncs == 0


def test_the_data_over_the_bus_is_that_of_the_bench_without_one():
    reference = 1.6 * np.sin(2.0 * np.pi * np.arange(400) / 400)
    columns = run(load_rig(RIG), 'voltage', reference, seed=5)
    master = Master()
    master.enable(-1)
    master.nodes.bench = bench = Bench(load_rig(RIG), seed=5)
    assert bench.time == 0.0
    for k, value in enumerate(reference):
        master.command('drive.rpdo2', value, 0.0)
        answers = master.sync()
        row = (answers['drive.tpdo1']['position_actual_value'],
               answers['load_encoder.tpdo1']['position_value'],
               answers['torque_sensor.tpdo1']['transmitted_torque'],
               answers['drive.tpdo2']['motor_current'],
               answers['drive.tpdo3']['applied_voltage'])
        assert row == tuple(columns[name][k] for name in (
            'motor_position', 'load_position', 'torque', 'current', 'voltage'))


def test_a_sync_at_another_rate_than_told_is_said_once(master, caplog):
    for _ in range(3500):
        master.now += 0.001  # with the one of sync(), twice the period
        master.sync()
    assert caplog.text.count('SYNC comes every 2 ms but object 1006h says 1 ms') == 1


def test_the_period_of_1006h_is_the_time_that_a_sync_takes(master):
    master.send((0x601, bytes([0x23, 0x06, 0x10, 0]) + (250).to_bytes(4, 'little')))
    for _ in range(400):
        master.sync()
    assert master.bench.time == pytest.approx(0.1)
