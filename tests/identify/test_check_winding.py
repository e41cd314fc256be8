"""What a drive shows that differs between recordings: the check ..."""

import re

from init_bench import gear_motor
import numpy as np
import pytest
from synthetic_recordings import run_of

from servo_identify.data.recording_check import check
from servo_twin.description.servo_file import loads

FILE = """
servo: m
drive: {drive}
mechanism: {{type: rigid, rotor_inertia: 3.2e-5, load_inertia: 0.012, ratio: 50.0}}
sensors: {{current_sensor: {{noise: 0.002}}, motor_encoder: {{noise: 4.4e-4}}}}
"""
WINDING = '{type: voltage, resistance: 2.1, back_emf: 0.045, torque_constant: 0.045}'
LOOP = '{type: current, gain: 0.5, torque_constant: 0.045}'


def run(number, resistance=2.1, emf=0.045, zero=0.0, drive=WINDING, family='sine'):
    """Return a recording of a gear motor; its command is what this drive needs for the motion."""
    made, chance = gear_motor(), np.random.default_rng(number)
    speed = np.gradient(made['theta'], made['time'])
    command = (resistance * made['i'] + emf * speed if drive == WINDING else 2.0 * made['i'])
    current = made['i'] + zero + 0.002 * chance.standard_normal(len(speed))
    known = {'voltage': command, 'current': current, 'motor_position': made['theta']}
    return run_of(number, 0.002, known, family)


def said(several, words, drive=WINDING):
    servo = loads(FILE.format(drive=drive))
    return [one for one in check(several, servo) if words in one.sentence]


def test_it_finds_nothing_that_differs_between_recordings_that_are_alike():
    assert not said([run(k) for k in range(4)], 'differs between')


def test_it_says_by_how_much_the_resistance_of_a_winding_differs():
    found, = said([run(k, 2.1 + 0.05 * k) for k in range(4)], 'differs between')
    assert 'resistance of the winding differs between recordings of sine: 2.' in found.sentence
    low, high = (float(one) for one in re.findall(r'(2\.\d+)', found.sentence))
    assert high - low == pytest.approx(0.15, rel=0.05)
    assert 'ohm in run_0' in found.sentence and 'in run_3' in found.sentence
    assert found.level == 'amber' and 'warm up' in found.action


def test_it_says_that_the_back_emf_differs():
    found, = said([run(k, emf=0.045 - 0.002 * k) for k in range(3)], 'differs between')
    assert 'back EMF of the motor differs' in found.sentence and '0.041' in found.sentence


@pytest.mark.parametrize('drive', [WINDING, LOOP])
def test_it_says_that_the_zero_of_the_current_differs_without_a_torque_sensor(drive):
    found, = said([run(k, zero=0.03 * k, drive=drive) for k in range(3)], 'zero of the current',
                  drive)
    assert 'run_2 has 0.0' in found.sentence and 'A more than run_0' in found.sentence
    size = float(found.sentence.split('run_2 has ')[1].split()[0])
    assert size == pytest.approx(0.06, rel=0.02) and 'offset' in found.action


def test_it_holds_only_recordings_of_one_motion_against_each_other():
    assert not said([run(k, 2.1 + 0.1 * k, family=f'motion {k}') for k in range(3)],
                    'differs between')
