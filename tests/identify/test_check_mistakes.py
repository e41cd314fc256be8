"""Realistic mistakes in recordings of every emulated rig: the check ..."""

from dataclasses import replace
from functools import lru_cache
from math import pi
from pathlib import Path
import re

import numpy as np
import pytest

from servo_identify.data.looked_over import looked_over
from servo_identify.data.scales import scale_findings, untold
from servo_identify.data.survey import limit_of
from servo_rig_driver.emulated.make_recording import make_recording
from servo_twin.description.servo_file import load
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.recording.recording import COLUMNS, Recording

CONFIG = Path(__file__).resolve().parents[2] / 'config'
ANGLES = ('motor_position', 'load_position')
AMPLITUDES = {'pan_tilt_azimuth': 6.0, 'pan_tilt_elevation': 6.0}
"""Volts that move a rig which two volts do not."""
RIGS = sorted(path.stem for path in (CONFIG / 'rigs').glob('*.yaml'))

LIMITED = [rig for rig in RIGS if np.isfinite(limit_of(load(CONFIG / f'servos/{rig}.yaml')))]


def findings(recordings, servo):
    return scale_findings(looked_over(recordings, servo))


def questions(recordings, servo):
    return untold(looked_over(recordings, servo))


@lru_cache
def recorded(rig, family='sine', channels='', turned=()):
    """Return five seconds of a rig; ``channels`` leaves some out: motor, load, no current."""
    settings = {'amplitude': AMPLITUDES.get(rig, 1.5)} if family == 'sine' else {}
    made = make_recording(family, CONFIG / 'rigs' / f'{rig}.yaml', settings=settings, duration=5.0,
                          rate=500.0, overrides=list(turned))
    columns = {name: made[name] for name in COLUMNS if name in made}
    left_out = {'motor': ('load_position', 'torque'), 'load': ('motor_position', 'torque'),
                'no current': ('current', 'torque')}.get(channels, ())
    columns |= {name: np.full(len(made['t']), np.nan) for name in left_out}
    return Recording(f'{rig} {family}', 0.002, columns)


@lru_cache
def servo_of(rig):
    """Return the shipped servo of a rig."""
    return load(CONFIG / 'servos' / f'{rig}.yaml')


def times(one, **factors):
    """Return a recording with channels multiplied."""
    return replace(one, columns={**one.columns, **{n: f * one[n] for n, f in factors.items()}})


def called(one, **names):
    """Return a recording whose channels are called otherwise: new=old; the old ones are gone."""
    nothing = np.full(len(one), np.nan)
    columns = {**one.columns, **dict.fromkeys(names.values(), nothing)}
    return replace(one, columns={**columns, **{new: one[old] for new, old in names.items()}})


def red(one, rig):
    """Return the red sentences about one recording."""
    return ' '.join(finding.sentence for finding in findings([one], servo_of(rig))
                    if finding.level == 'red')


def mistakes(one, rig):
    """Yield (what was done, words that must be said) for all that such a recording can have."""
    there = [name for name in ANGLES if one.has(name)]
    servo = servo_of(rig)
    for name in there:
        yield times(one, **{name: -1.0}), (name, 'other sign')
        unit, factor, words = (('1/1000', 1e3, 'mm') if servo.straight(name) else
                               ('57.3', 180.0 / pi, 'degrees'))
        yield times(one, **{name: factor}), (unit, f'{name} is in {words}')
    if len(there) == 2:
        yield times(one, **dict.fromkeys(there, -1.0)), ('other sign',)
        yield called(one, motor_position='load_position', load_position='motor_position'), (
            'encoders are exchanged',)
        if not any(servo.straight(name) for name in there):
            yield times(one, **dict.fromkeys(there, 180.0 / pi)), ('57.3', 'are in degrees')
    yield replace(one, period=1e3 * one.period), ('0.001', 'milliseconds')
    yield times(one, voltage=-1.0), ('voltage', 'other sign')
    yield times(one, voltage=1e3), ('1/1000', 'mV')
    if one.has('current'):
        yield times(one, current=-1.0), ('current has the other sign',)
        yield times(one, current=1e3), ('1/1000', 'mA')
        yield times(one, current=-1.0, voltage=-1.0), ('opposite sign',)
    if one.has('torque'):
        yield times(one, torque=-1.0), ('torque sensor reads against',)
        yield times(one, torque=1e3), ('1/1000', 'mN m')


@pytest.mark.parametrize('rig', RIGS)
def test_it_is_not_red_about_correct_recordings_of(rig):
    for family, channels in (('sine', ''), ('sine', 'motor'), ('sine', 'load'),
                             ('multisine', 'no current'), ('speed_ladder', '')):
        one = recorded(rig, family, channels)
        if any(one.has(name) for name in ANGLES):
            assert red(one, rig) == '', (family, channels)


@pytest.mark.parametrize('rig', RIGS)
def test_it_names_each_mistake_and_its_factor_in_recordings_of(rig):
    one = recorded(rig)
    for spoilt, words in mistakes(one, rig):
        said = red(spoilt, rig)
        missing = [word for word in words if word not in said]
        assert not missing, (words, said)


def test_it_names_the_sign_of_an_external_torque_and_asks_nothing_where_there_is_none():
    made = make_recording('load_steps', CONFIG / 'rigs' / 'rv_bench.yaml', settings={},
                          duration=20.0, rate=250.0)
    one = Recording('load steps', 0.004, {name: made[name] for name in COLUMNS if name in made})
    turned = times(one, external_torque=-1.0)
    assert 'positive where it pushes forward' in red(turned, 'rv_bench')
    assert red(one, 'rv_bench') == ''
    still = times(recorded('rv_bench'), external_torque=0.0)
    assert not any('external' in asked.sentence
                   for asked in questions([still], servo_of('rv_bench')))


@pytest.mark.parametrize(('rig', 'has', 'is_of'), [
    ('rv_bench', 'motor', 'load'), ('rv_bench', 'load', 'motor'), ('geared_dc', 'motor', 'load'),
    ('dc_gearmotor', '', 'load'), ('ema_bench', 'load', 'motor')])
def test_it_sees_an_encoder_of_the_other_shaft_where_there_is_one(rig, has, is_of):
    one = recorded(rig, 'sine', has)
    right = 'load_position' if has == 'load' else 'motor_position'
    wrong = 'motor_position' if has == 'load' else 'load_position'
    said = red(called(one, **{wrong: right}), rig)
    assert 'angle of the other shaft' in said, said


def test_it_asks_for_the_shaft_where_an_inertia_could_be_as_wrong():
    found, = findings([called(recorded('robstride'), load_position='motor_position')],
                            servo_of('robstride'))
    assert found.level == 'amber' and 'that of the other shaft?' in found.sentence


@pytest.mark.parametrize(('factor', 'word'), [(30.0 / pi, 'rpm'), (180.0 / pi, 'deg/s'),
                                              (-1.0, 'runs against')])
def test_it_sees_the_unit_and_the_sign_of_a_reference_speed(factor, word):
    one = recorded('rv_bench', 'speed_ladder')
    assert word in red(times(one, reference_velocity=factor), 'rv_bench')


@pytest.mark.parametrize('rig', LIMITED)
@pytest.mark.parametrize(('full', 'words'), [(1.0, 'a duty, a share of its limit'),
                                             (100.0, 'a duty in %')])
def test_it_sees_that_a_command_is_a_share_of_its_limit(rig, full, words):
    assert words in red(times(recorded(rig), voltage=full / limit_of(servo_of(rig))), rig)


@pytest.mark.parametrize('rig', sorted({*RIGS} - {*LIMITED}))
def test_it_sees_that_a_command_without_a_limit_has_a_unit_of_its_own(rig):
    for factor in (0.05, 100.0):
        said = red(times(recorded(rig), voltage=factor), rig)
        assert 'voltage is in a unit of its own' in said, said


def test_it_says_what_one_count_of_command_and_current_is():
    counts = times(recorded('dc_gearmotor'), voltage=885.0 / 12.0, current=1.0 / 2.69e-3)
    found, = (one for one in findings([counts], servo_of('dc_gearmotor')) if one.level == 'red')
    volts, amperes = (float(x) for x in re.findall(r'\[([\d.e-]+) [VA]\]', found.action))
    assert 'voltage and current are in units of their own' in found.sentence
    assert volts == pytest.approx(12.0 / 885.0, rel=0.1)
    assert amperes == pytest.approx(2.69e-3, rel=0.2)


def test_it_sees_voltage_and_current_swapped_where_a_drive_tells_them_apart():
    for rig in ('rv_bench', 'dc_gearmotor', 'geared_dc'):
        assert 'swapped' in red(called(recorded(rig), voltage='current', current='voltage'), rig)


@pytest.mark.parametrize('family', ['sine', 'slow_reversals', 'speed_ladder'])
@pytest.mark.parametrize('channels', ['motor', 'load'])
def test_a_back_emf_tells_voltage_and_current_apart_where_one_volt_makes_one_ampere(
        family, channels):
    given = servo_of('geared_dc')
    servo = replace(given, values={**given.values, 'drive.resistance': 1.0})
    one = recorded('geared_dc', family, channels, ('drive.resistance=1.0',))
    assert [found.level for found in findings([one], servo)] in ([], ['amber'])
    found, = findings([called(one, voltage='current', current='voltage')], servo)
    assert found.level == 'red' and 'voltage and current are swapped' in found.sentence


def test_it_says_that_a_drive_of_currents_hides_which_of_command_and_current_is_which():
    servo = servo_of('ema_bench')
    told, = questions([recorded('ema_bench'), recorded('ema_bench', 'multisine')], servo)
    assert told.level == 'amber' and told.action
    assert 'cannot tell whether voltage and current are swapped' in told.sentence
    assert questions([recorded('geared_dc')], servo_of('geared_dc')) == []


def test_it_does_not_ask_which_is_which_of_two_columns_that_are_alike():
    several = [recorded('odrive'), recorded('odrive', 'multisine')]
    assert questions(several, servo_of('odrive')) == []


def test_it_has_no_doubts_on_a_reference_that_the_controller_does_not_read():
    one, servo = recorded('feed_drive'), servo_of('feed_drive')
    assert servo.values['controller.kf'] == 0.0
    slow = replace(one, columns={**one.columns, 'reference_velocity': 1e-9 * np.ones(len(one))})
    assert not any('reference_velocity' in said.sentence for said in questions([slow], servo))
    reads = servo.with_values({'controller.kf': 1.0})
    assert any('reference_velocity' in said.sentence for said in questions([slow], reads))


def test_it_names_two_mistakes_at_once():
    said = red(times(recorded('rv_bench'), current=1e3, load_position=-1.0), 'rv_bench')
    assert 'mA' in said and 'load_position' in said


@pytest.mark.parametrize('rig', ['rv_bench', 'dc_gearmotor', 'robstride'])
def test_a_servo_file_that_is_half_off_is_no_mistake_of_the_table(rig):
    given = servo_of(rig)
    for factor in (0.5, 2.0):
        for path in ('mechanism.load_inertia', 'drive.torque_constant', 'drive.gain'):
            servo = replace(given, tolerance={}, values={
                **given.values, path: factor * given.values[path]})
            found = findings([recorded(rig)], servo)
            assert [one for one in found if one.level == 'red'] == []


def test_one_recording_of_several_stops_a_diagnosis_only_if_its_mistake_explains_it():
    good = [replace(recorded('rv_bench', family), name=family)
            for family in ('sine', 'multisine', 'speed_ladder')]
    degrees = replace(times(good[0], motor_position=180.0 / pi), name='in degrees')
    red_ones = [one.sentence for one in findings([*good, degrees], servo_of('rv_bench'))
                if one.level == 'red']
    assert len(red_ones) == 1
    assert red_ones[0].startswith('in degrees: ') and 'degrees' in red_ones[0]
    # somebody pushes the load: the shaft goes against the torque of the motor, and not in
    # proportion to it
    t = np.arange(len(good[0])) * good[0].period
    push = 0.7 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 0.31 * t)
    pushed = replace(good[0], name='pushed', columns={
        **good[0].columns,
        **{name: np.std(good[0][name]) * push - 0.5 * good[0][name]
           for name in ('voltage', 'current')}})
    told = findings([*good, pushed], servo_of('rv_bench'))
    assert [one.level for one in told] == ['amber'] and told[0].sentence.startswith('pushed: ')


@pytest.mark.parametrize('known', [True, False])
def test_a_press_that_works_against_a_spring_is_not_in_degrees(known):
    servo = servo_of('rv_bench').with_values({
        'mechanism.ratio': 10.0, 'mechanism.load_inertia': 0.35})
    if known:
        servo = servo.with_effects(Placed('spring', find('spring_load'), 'load'), values={
            'effects.spring.stiffness': 60.0, 'effects.spring.rest': 0.0})
    time = np.arange(4000) * 2e-3
    angle = 1.67 * 2.0 / np.pi * np.arcsin(0.999 * np.sin(2.0 * np.pi * 0.4 * time))
    speed = np.gradient(angle, 2e-3)
    torque = 60.0 * angle + 7.0 * np.sign(speed) + 0.35 * np.gradient(speed, 2e-3)
    nothing = {name: np.full(len(time), np.nan) for name in COLUMNS}
    one = Recording('press', 2e-3, {
        **nothing, 'motor_position': 10.0 * angle, 'load_position': angle, 'torque': torque,
        'reference_position': angle, 'reference_velocity': speed,
        'current': torque / 10.0 / servo.values['drive.torque_constant']})
    assert not [found for found in findings([one], servo) if found.level == 'red']
