"""Play is measured from recordings that go both ways, and its curve over a slide."""

from math import pi
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from involute_bench import drawn_play, PLAIN, RIG
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.learn.transmission.two_way_backlash import measured_play, slide_of, with_curve
from servo_rig_driver.emulated.emulated_bench import run
from servo_twin.bag import write_recording
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import ServoError
from servo_twin.recording.recording import COLUMNS, Recording

FILE = Path(__file__).parents[2] / 'config' / 'servos' / 'ema_bench.yaml'
SERVO = servo_file.load(FILE)
SLACK = SERVO.with_values({'effects.encoder_coulomb.level': 0.0,
                           'effects.encoder_viscous.slope': 0.0})  # nothing winds the teeth up
RATIO, PERIOD = 124.0, 1e-3


def follower(motor, width, where):
    """Return what a gap of ``width`` lets through, begun somewhere ``where`` (0 to 1) in it."""
    at, answer = motor[0] + (where - 0.5) * width, []
    for angle in motor.tolist():
        at = min(max(at, angle - 0.5 * width), angle + 0.5 * width)
        answer.append(at)
    return np.array(answer)


@settings(max_examples=25, deadline=None)
@given(width=st.floats(1e-4, 0.1), amplitude=st.floats(0.3, 1.0), frequency=st.floats(0.1, 0.5),
       phase=st.floats(-3.0, 3.0), where=st.floats(0.0, 1.0), noise=st.floats(0.0, 1e-4),
       bent=st.floats(-3e-3, 3e-3), seed=st.integers(0, 999))
def test_the_width_of_a_gap_is_found_whatever_lies_on_it(width, amplitude, frequency, phase, where,
                                                         noise, bent, seed):
    t = np.arange(12_000) * PERIOD
    motor = amplitude * np.sin(2.0 * pi * frequency * t + phase)
    load = follower(motor, width, where)
    # an error of the teeth, the same both ways; noise of the encoder
    motor = motor + bent * np.sin(load + 0.4)
    load = load + noise * np.random.default_rng(seed).standard_normal(len(t))
    found = measured_play(SLACK, Recording('r', PERIOD, {
        'motor_position': RATIO * motor, 'load_position': load}))
    assert found.width == pytest.approx(width, abs=2e-5 + 0.2 * noise + 1e-3 * width)
    assert found.wound == 0.0


def test_a_recording_that_never_turns_back_or_lacks_an_encoder_is_refused():
    ramp = np.linspace(0.0, 1.0, 4000)
    with pytest.raises(ValueError, match='0 of 5 cells .* passed both ways'):
        measured_play(SLACK, Recording('r', PERIOD, {'motor_position': RATIO * ramp,
                                                     'load_position': ramp}))
    with pytest.raises(ValueError, match='load_position is missing'):
        measured_play(SLACK, Recording('r', PERIOD, {'motor_position': ramp}))


def slow_move(width, seconds=6.0, period=0.01):
    """Return a recording at 100 Hz that goes a quarter of a degree forth and back."""
    t = np.arange(0.0, seconds, period)
    motor = 4e-3 * 0.5 * (1.0 - np.cos(2.0 * pi * t / seconds))
    load = follower(motor, width, 0.0)
    return Recording('short', period, {'motor_position': RATIO * motor, 'load_position': load})


def test_a_short_slow_move_is_told_by_fewer_and_wider_cells():
    found = measured_play(SLACK, slow_move(4e-4))
    assert found.width == pytest.approx(4e-4, rel=0.01) and 5 <= len(found.widths) < 40


def test_a_bag_that_tells_none_does_not_stop_the_others(tmp_path, capsys):
    ramp = np.linspace(0.0, 1.0, 4000)
    stays = Recording('never_back', PERIOD, {'motor_position': RATIO * ramp,
                                             'load_position': ramp})
    bags = [str(write_recording(tmp_path / one.name, one)) for one in (stays, slow_move(4e-4))]
    assert main(['play', *bags, '--servo', str(FILE)]) == 1
    said = capsys.readouterr()
    assert 'short: 0.' in said.out and 'left out: never_back' in said.err
    assert main(['play', bags[0], '--servo', str(FILE)]) == 2
    assert 'no bag is left' in capsys.readouterr().err


@pytest.mark.parametrize('name', ['n10', 'n20', 'p10', 'p20'])
def test_the_lost_motion_of_an_axis_with_two_encoders_is_the_published_one(shared_data, name):
    raw = np.loadtxt(shared_data / 'bifrost' / f'{name}.csv', delimiter=',', skiprows=1)
    recording = Recording(name, 0.01, {'motor_position': RATIO * np.radians(raw[:, 1]),
                                       'load_position': np.radians(raw[:, 2])})
    assert 0.024 < np.degrees(measured_play(SLACK, recording).width) < 0.028


def of_rig(setting, seed=0):
    t = np.arange(12_500) * PERIOD
    rig = RIG.with_values({**PLAIN, 'carrier.setting': setting, 'sensors.noise': 1.0})
    columns = run(rig, 'position', 0.5 * np.sin(0.16 * pi * t), seed=seed)
    return Recording(f'play_{1e3 * setting:g}', PERIOD, {
        n: columns[n] for n in COLUMNS if n in columns})


def test_the_curve_over_the_slide_is_that_of_the_gears_as_drawn(tmp_path, capsys):
    opened = (4e-4, 1.2e-3, 2.2e-3)
    at = [0.0096 + x for x in opened]
    bags = [str(write_recording(tmp_path / f'bag{k}', of_rig(s))) for k, s in enumerate(at)]
    new = tmp_path / 'new.yaml'
    assert main(['play', *bags, '--servo', str(FILE), '--settings', *map(str, at),
                 '-o', str(new)]) == 0
    assert 'bag1 at 10.8 mm' in capsys.readouterr().out
    servo = servo_file.load(new)
    law = find('carrier_backlash').law

    def width(setting):
        p = type('P', (), {n: servo.values[f'effects.play.{n}'] for n in (
            'settings', 'widths', 'cosine', 'sine')})
        p.setting = setting
        motion = find('carrier_backlash').motion(0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        return law(p, (), motion, 1e-4)

    for setting, x in zip(at, opened, strict=True):
        assert width(setting) == pytest.approx(drawn_play(0.09 + x), abs=4e-4)
    between = width(0.0096 + 1.7e-3)  # a setting that was not recorded
    assert between == pytest.approx(drawn_play(0.09 + 1.7e-3), abs=6e-4)


@pytest.mark.parametrize('arguments, words', [
    (['a.csv', 'b.csv', '--settings', '0.01'], '2 bags and 1 settings'),
    (['a', '-o', 'x.yaml'], 'needs --settings'),
    (['a', 'b', '--settings', '0.01', '0.01'], 'the same setting'),
])
def test_the_command_names_what_does_not_go_together(arguments, words, capsys, tmp_path,
                                                     monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ('a.csv', 'b.csv'):
        Path(name).touch()
    assert main(['play', *arguments, '--servo', str(FILE)]) != 0
    assert words in capsys.readouterr().err


def test_a_servo_without_a_slide_takes_no_curve():
    plain = servo_file.load(FILE.with_name('geared_dc.yaml'))
    with pytest.raises(ServoError, match='no effect carrier_backlash'):
        with_curve(plain, {}, [])


def test_the_line_that_a_servo_without_a_slide_needs_is_told_before_a_bag_is_read(
        tmp_path, capsys):
    file, bags = FILE.with_name('geared_dc.yaml'), [tmp_path / f'{name}.mcap' for name in 'ab']
    for bag in bags:
        bag.write_text('no bag, as reading it would find')
    assert main(['play', *map(str, bags), '--settings', '0.011', '0.012', '--servo', str(file),
                 '-o', str(tmp_path / 'new.yaml')]) == 2
    said, line = capsys.readouterr().err.rstrip().split('\n')
    assert 'add the next line to the section effects of its file, in place of play,' in said
    new = tmp_path / 'with.yaml'
    new.write_text(file.read_text().replace('\neffects:\n', f'\neffects:\n{line}\n'))
    servo = servo_file.load(new)
    assert servo.values['effects.slide.setting'] == 0.011 and slide_of(servo) == 'slide'
