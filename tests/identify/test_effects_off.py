"""A servo as one with more effects, these off: the same to the last bit, and no other kernel."""

from dataclasses import replace

import numpy as np
import pytest

from servo_identify.diagnose.handover.trial import as_in
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.kernel import kernel_of
from servo_twin.physics.servo import Placed
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS

BENCH = servo_file.load('config/servos/rv_bench.yaml')
MORE = (Placed('fades', find('stribeck_friction'), 'load'),
        Placed('lags', find('presliding_friction'), 'load'),
        Placed('wave', find('transmission_error'), 'mesh'),
        Placed('play', find('load_dependent_backlash'), 'mesh'),
        Placed('late', find('command_delay'), 'command'))


def ran(servo):
    time = np.arange(400) * 1e-3
    columns = {name: np.zeros(400) for name in INPUTS} | {'voltage': np.sin(30.0 * time)}
    return simulate(servo, inputs_of(columns), 1e-3, initial_state(servo, 0.0, 0.0))


@pytest.fixture(scope='module')
def whole():
    return replace(BENCH, effects=(*BENCH.effects, *MORE))


def test_effects_that_are_off_change_no_bit(whole):
    other = as_in(BENCH, whole)
    assert kernel_of(other) is kernel_of(whole)
    assert not np.array_equal(ran(whole), ran(BENCH))
    np.testing.assert_array_equal(ran(other), ran(BENCH))


def test_values_are_those_of_the_smaller_servo(whole):
    path = next(path for path in BENCH.values if path.startswith('effects.'))
    moved = BENCH.with_values({path: 1.5 * BENCH.numbers[path]})
    assert as_in(moved, whole).numbers[path] == 1.5 * BENCH.numbers[path]


def test_what_is_no_part_of_a_servo_stays_as_it_is(whole):
    coarser = replace(BENCH, step=2.0 * BENCH.step)
    assert as_in(coarser, whole) is coarser and as_in(whole, BENCH) is whole
