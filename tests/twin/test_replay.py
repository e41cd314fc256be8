"""Replay: a recording through the twin, as files and through the graph."""

from dataclasses import replace
from pathlib import Path
from threading import Thread
from time import monotonic

from bench_recording import bench_recording, SERVO, without
import numpy as np
import pytest

from servo_twin.bag import read_predictions, read_recording, write_predictions, write_recording
from servo_twin.balances.goodness_of_fit import fit_of, goodness, speed_of
from servo_twin.cli import main
from servo_twin.commands.terminal import whole_bag
from servo_twin.description.servo_file import load
from servo_twin.lockstep.live_comparison import differences
from servo_twin.lockstep.lockstep import Lockstep, Settings
from servo_twin.lockstep.whole_recording import answer
from servo_twin.physics.servo import ServoError
from servo_twin.recording.joined_samples import samples_of


@pytest.fixture(scope='module')
def recording():
    return bench_recording()


@pytest.fixture(scope='module')
def servo():
    return load(SERVO)


def answered_live(recording, servo, settings, block):
    """Answer block by block, as the node does, and put the answers together."""
    line = Lockstep(servo, recording.period, settings)
    samples = samples_of(recording.columns)
    y, residuals = [], []
    for at in range(0, len(samples), block):
        prediction, due = line.step(recording.sequence + at, 0, samples[at:at + block])
        y.append(prediction.values)
        residuals += [part.values for part in due]
    residuals += [part.values for part in line.finish()]
    return np.vstack(y), np.vstack(residuals)


@pytest.mark.parametrize('mode', ['measured_input', 'closed_loop', 'observer'])
def test_it_gives_the_bits_of_the_live_run(recording, servo, mode):
    settings = Settings(mode=mode)
    y, residuals = answered_live(recording, servo, settings, 7)
    again = answer(recording, servo, settings)
    for column, name in enumerate(again.prediction):
        np.testing.assert_array_equal(again.prediction[name], y[:, column])
    for column, name in enumerate(again.residual):
        np.testing.assert_array_equal(again.residual[name], residuals[:, column])


def test_it_writes_a_bag_whose_predictions_compare_as_identical(recording, tmp_path, capsys):
    bag = write_recording(tmp_path / 'bag', recording, 1)
    assert main(['replay', str(bag), '-o', str(tmp_path / 'out')]) == 0
    assert main(['replay', str(tmp_path / 'out'), '--compare']) == 0
    assert 'identical to the last bit' in capsys.readouterr().out
    written = read_predictions(tmp_path / 'out')
    assert written.sequence == recording.sequence
    assert written.start == pytest.approx(recording.start, abs=1e-9)


def test_it_says_where_a_replay_differs(recording, servo, tmp_path, capsys):
    result = answer(recording, servo)
    result.prediction['torque'][100] = np.nextafter(result.prediction['torque'][100], np.inf)
    bag = write_predictions(tmp_path / 'bag', result, recording)
    assert main(['replay', str(bag), '--compare', '--quiet']) == 1
    assert 'prediction torque at 1 samples' in capsys.readouterr().err


def test_it_compares_where_the_live_twin_ran(recording, servo):
    late = recording.part(recording.sequence + 300, recording.sequence + 900)
    assert late.start == pytest.approx(recording.start + 0.3)
    live = answer(late, servo)
    again = answer(recording.part(live.sequence, live.sequence + len(live)), servo)
    assert len(again) == 600
    assert not any(differences(live, again).values())
    with pytest.raises(ServoError, match='the replay others'):
        differences(live, answer(bench_recording(0.1), servo))


def test_it_bridges_lost_samples_as_the_live_twin_does(recording, servo):
    gap = slice(500, 520)
    holed = without(recording, gap)
    samples = samples_of(recording.columns)
    line = Lockstep(servo, recording.period, Settings())
    before, _ = line.step(0, 0, samples[:500])
    after, _ = line.step(520, 0, samples[520:])
    again = answer(holed, servo)
    np.testing.assert_array_equal(again.prediction['torque'][:500], before.values[:, 2])
    np.testing.assert_array_equal(again.prediction['torque'][520:], after.values[:, 2])
    assert np.isnan(again.prediction['torque'][gap]).all()
    assert again.restarts == 0
    assert '20 samples are missing; 20 were bridged' in again.warnings


def test_it_begins_anew_after_a_long_gap_and_says_so(recording, servo):
    again = answer(without(recording, slice(500, 900)), servo)
    assert again.restarts == 1
    assert 'the twin began again 1 times' in again.warnings[0]


@pytest.mark.parametrize('lacking, said', [
    ((), ''), (('reference_velocity',), 'reference_velocity was not recorded: the loop')])
def test_it_says_that_no_reference_closed_the_loop(recording, servo, lacking, said):
    nothing = np.full(len(recording), np.nan)
    again = answer(replace(recording, columns={
        **recording.columns, **dict.fromkeys(lacking, nothing)}), servo, Settings('closed_loop'))
    assert [one[:len(said)] for one in again.warnings] == [said] * len(lacking)


def test_it_refuses_a_loop_without_a_reference_and_a_command(recording, servo):
    nothing = np.full(len(recording), np.nan)
    columns = {**recording.columns, 'reference_velocity': nothing, 'voltage': nothing}
    with pytest.raises(ServoError, match=r"none of \['reference_velocity', 'voltage'\] was"):
        answer(replace(recording, columns=columns), servo, Settings('closed_loop'))


@pytest.mark.parametrize('lacking, said', [
    (('motor_position', 'load_position'), 'none of'), (('voltage',), 'voltage was not recorded')])
def test_it_refuses_a_recording_it_cannot_run_on(recording, servo, lacking, said):
    columns = dict(recording.columns)
    for name in lacking:
        columns[name] = np.full(len(recording), np.nan)
    poor = type(recording)('poor', recording.period, columns)
    with pytest.raises(ServoError, match=said):
        answer(poor, servo)


@pytest.mark.parametrize('words, said', [
    (['replay', '/nowhere/bag'], '/nowhere/bag'),
    (['replay', 'BAG', '--servo', '/nowhere.yaml'], '/nowhere.yaml: cannot be read'),
    (['replay', 'BAG', '--namespace', 'other'], "no rig in namespace 'other'"),
    (['replay', 'BAG', '--graph', '--rate', '0'], 'outside (0, 1000]'),
    (['replay', 'BAG', '--compare'], 'no topic /twin/prediction'),
    (['nonsense'], "no command 'nonsense'"),
])
def test_it_says_what_is_wrong_in_one_line(recording, tmp_path, capsys, words, said):
    bag = write_recording(tmp_path / 'bag', recording)
    try:
        status = main([str(bag) if word == 'BAG' else word for word in words])
    except SystemExit as ended:  # what cannot be an argument ends before the command begins
        status = ended.code
    assert status == 2
    assert said in capsys.readouterr().err


def test_it_needs_a_servo_file_for_a_bag_without_one(recording, tmp_path, capsys):
    bare = type(recording)('bare', recording.period, recording.columns)
    bag = write_recording(tmp_path / 'bag', bare)
    assert main(['replay', str(bag)]) == 2
    assert 'give one by --servo' in capsys.readouterr().err


def test_it_shows_the_fit_of_every_channel_and_balance(servo):
    rough = bench_recording(coulomb=30.0)
    fit = fit_of(rough, answer(rough, servo), servo)
    by_name = {row.balance: row.over_noise for row in fit.balances}
    assert by_name['load'] > 20.0 > 10.0 > by_name['transmission']
    assert {row.channel for row in fit.channels} == {
        'motor_position', 'load_position', 'torque', 'current', 'motor_speed', 'load_speed'}


def test_goodness_is_that_of_the_paper():
    rig, twin = np.array([3.0, 4.0, np.nan]), np.array([3.0, 3.0, 1.0])
    assert goodness(rig, twin) == pytest.approx(1.0 - np.sqrt(1.0 / 25.0))
    assert goodness(rig, rig) == 1.0
    assert np.isnan(goodness(np.zeros(3), twin))


def test_speeds_are_differences_of_angles():
    time = np.arange(200) * 1e-3
    speed = speed_of(3.0 * time, 1e-3)
    assert np.isnan(speed[0])
    np.testing.assert_allclose(speed[50:150], 3.0)


@pytest.mark.ros
def test_it_plays_a_bag_into_the_graph_with_a_clock(tmp_path):
    import rclpy
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from rosgraph_msgs.msg import Clock

    from servo_twin.nodes.graph_replay import GraphReplay
    from servo_twin_msgs.msg import Current, Encoder, Torque

    recording = bench_recording(0.5)
    bag = write_recording(tmp_path / 'bag', recording, namespace='played')
    rclpy.init()
    listener = rclpy.create_node('listener')
    heard = {'encoder': [], 'torque': [], 'current': [], 'clock': []}
    qos = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
    for topic, kind in (('encoder', Encoder), ('torque', Torque), ('current', Current)):
        listener.create_subscription(kind, f'/played/{topic}', heard[topic].append, qos)
    listener.create_subscription(Clock, '/clock', heard['clock'].append, qos)
    node = GraphReplay(read_recording(bag), 2.0, 'played')
    sent = []
    thread = Thread(target=lambda: sent.append(node.play()))
    begin = monotonic()
    thread.start()
    while monotonic() - begin < 20.0 and min(map(len, heard.values())) < 50:
        rclpy.spin_once(listener, timeout_sec=0.1)
    thread.join()
    node.destroy_node()
    listener.destroy_node()
    rclpy.try_shutdown()
    assert sent == [500]
    load = np.concatenate([np.array(message.load_position) for message in heard['encoder']])
    np.testing.assert_array_equal(load, recording['load_position'])
    assert heard['encoder'][0].sequence == recording.sequence
    stamps = [clock.clock.sec + clock.clock.nanosec * 1e-9 for clock in heard['clock']]
    assert stamps == sorted(stamps)
    assert stamps[-1] == pytest.approx(recording.start + recording.duration)


def test_the_three_real_machines_have_servo_files():
    folder = Path(SERVO).parent
    for name in ('emps', 'xl330', 'two_mass'):
        machine = load(folder / f'{name}.yaml')
        effects = {placed.effect.name for placed in machine.effects}
        assert effects <= {'coulomb_friction', 'viscous_friction', 'gravity'}
        assert machine.tolerance
        assert all(path in machine.provenance for path, _ in machine.declarations()
                   if not path.startswith(('observer', 'sensors', 'controller', 'effects')))


def contents(folder):
    return {str(one.relative_to(folder)): one.read_bytes() for one in folder.rglob('*')
            if one.is_file()}


def test_a_replay_that_fails_late_leaves_the_bag_that_it_was_to_write_over(recording, tmp_path,
                                                                          monkeypatch):
    bag, out = write_recording(tmp_path / 'bag', recording, 1), tmp_path / 'out'
    assert main(['replay', str(bag), '-o', str(out)]) == 0
    before, written = contents(tmp_path), []

    def fails(writer, *part):
        written.append(writer.path)
        raise OSError(28, 'No space left on device')
    with monkeypatch.context() as full:
        full.setattr('servo_twin.bag.RecordingWriter.add', fails)
        assert main(['replay', str(bag), '-o', str(out), '--force', '--quiet']) == 2
    assert written
    assert contents(tmp_path) == before
    assert main(['replay', str(bag), '-o', str(out), '--force', '--quiet']) == 0
    assert contents(tmp_path).keys() == before.keys()
    assert read_recording(out).has('motor_position')


@pytest.mark.parametrize(('measured', 'left'), [(False, {}), (True, {'bag/bag_0.mcap': b'half'})])
def test_of_a_bag_that_fails_only_what_was_measured_stays(tmp_path, measured, left):
    with pytest.raises(OSError), whole_bag(tmp_path / 'bag', measured) as new:
        new.mkdir()
        (new / 'bag_0.mcap').write_text('half')
        raise OSError
    assert contents(tmp_path) == left


def test_a_bag_takes_the_place_of_another_when_it_is_whole(tmp_path):
    place = tmp_path / 'bag'
    for number in range(2):
        with whole_bag(place) as new:
            new.mkdir()
            (new / 'bag_0.mcap').write_text(str(number))
            assert number == 0 or (place / 'bag_0.mcap').read_text() == '0'
        assert contents(tmp_path) == {'bag/bag_0.mcap': str(number).encode()}
    with pytest.raises(KeyboardInterrupt), whole_bag(place) as new:
        new.mkdir()
        (new / 'bag_0.mcap').write_text('half')
        raise KeyboardInterrupt
    assert contents(tmp_path) == {'bag/bag_0.mcap': b'1'}
