"""The compiled step: made once for each structure, kept on disk, never taken for another."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import every_effect
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from servo_twin.physics.catalogue import find
from servo_twin.physics.controllers import Open
from servo_twin.physics.drives import CurrentDrive
from servo_twin.physics.kernel import kernel_of
from servo_twin.physics.mechanisms.friction_step import slide
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.servo import Placed, Servo
from servo_twin.physics.simulate import initial_state, simulate, simulate_many

LAW = '''"""A drag."""
from servo_twin.physics.effect import Parameter
from servo_twin.physics.ports import Torque


class Drag(Torque):
    """Drag."""
    source = 'this test'
    slope = Parameter(1.0, 'N m s/rad', (0.0, 10.0), 'Rise.', off=0.0)

    @staticmethod
    def law(p, s, motion, h):
        return -{factor} * p.slope * motion.speed
'''
RUN = """
import json, sys
import numpy as np
from servo_twin.physics.catalogue import find, register
from servo_twin.physics.controllers import Open
from servo_twin.physics.drives import CurrentDrive
from servo_twin.physics.kernel import kernel_of
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.servo import Placed, Servo
from servo_twin.physics.simulate import initial_state, simulate
from servo_twin.physics.state import INPUTS
register(sys.argv[1])
servo = Servo('s', CurrentDrive, Rigid, Open, (), (Placed('d', find('drag'), 'motor'),))
u = np.zeros((50, len(INPUTS)))
u[:, 0] = 1.0
y = simulate(servo, u, 1e-3, initial_state(servo))
kernel = kernel_of(servo)
stats = kernel.run.stats
print(json.dumps([kernel.module.__name__, sum(stats.cache_hits.values()),
                  sum(stats.cache_misses.values()), y[-1, 0]]))
"""


def in_a_process(folder, cache):
    done = subprocess.run([sys.executable, '-c', RUN, folder], capture_output=True, text=True,
                          env={**os.environ, 'SERVO_TWIN_CACHE': str(cache)})
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.long
@pytest.mark.slow
def test_a_second_process_loads_what_the_first_compiled_and_an_edit_makes_another(tmp_path):
    laws, cache = tmp_path / 'laws', tmp_path / 'cache'
    laws.mkdir()
    (laws / 'drag.py').write_text(LAW.replace('{factor}', '1.0'))
    name, hits, misses, answer = in_a_process(laws, cache)
    assert (hits, misses) == (0, 1)
    assert in_a_process(laws, cache) == [name, 1, 0, answer]
    (laws / 'drag.py').write_text(LAW.replace('{factor}', '2.0'))
    edited, hits, misses, other = in_a_process(laws, cache)
    assert edited != name and (hits, misses) == (0, 1)
    assert other < answer


def test_servos_of_one_structure_share_a_kernel_whatever_their_values():
    first = every_effect.servo()
    second = every_effect.servo({'mechanism.ratio': 50.0, **every_effect.off()})
    assert kernel_of(first) is kernel_of(second)


def test_servos_of_other_structure_have_kernels_of_their_own():
    plain = Servo('a', CurrentDrive, Rigid, Open)
    with_friction = plain.with_effects(Placed('c', find('coulomb_friction'), 'load'))
    moved = plain.with_effects(Placed('c', find('coulomb_friction'), 'motor'))
    assert len({kernel_of(s).module.__name__ for s in (plain, with_friction, moved)}) == 3


def test_many_runs_on_several_threads_are_the_single_runs_to_the_last_bit():
    servo = every_effect.servo()
    u = every_effect.inputs(60, voltage=3.0 * np.sin(0.1 * np.arange(60)))
    x = initial_state(servo, 0.0, 0.0)
    thetas = [servo.theta * (1.0 + 1e-3 * i) for i in range(6)]
    many = simulate_many(servo, u, 1e-3, x, thetas)
    for theta, y in zip(thetas, many, strict=True):
        assert np.array_equal(simulate(servo, u, 1e-3, x.copy(), theta=theta), y)


@pytest.mark.long
def test_an_effect_that_vanished_takes_part_again_once_its_amplitude_is_there():
    place = Placed('c', find('cogging'), 'motor')
    servo = Servo('a', CurrentDrive, Rigid, Open, (), (place,))
    gone = servo.with_values({'effects.c.cosine': (0.0,), 'effects.c.sine': (0.0,)})
    u, on = every_effect.inputs(50, voltage=0.5), servo.switches
    x = initial_state(gone, 0.3)
    simulate(gone, u, 1e-3, x, on=on)
    assert on.all()
    there, switched_off = x.copy(), x.copy()
    felt = simulate(servo, u, 1e-3, there)
    assert not np.array_equal(felt, simulate(servo, u, 1e-3, switched_off, on=~on))
    assert np.array_equal(simulate(gone, u, 1e-3, x.copy()),
                          simulate(gone, u, 1e-3, x.copy(), on=~on))


def test_the_rows_of_an_effect_are_filled_up_to_the_longest():
    place = Placed('te', find('cogging'), 'motor')
    servo = Servo('a', CurrentDrive, Rigid, Open, (), (place,),
                  {'effects.te.sine': (1.0, 2.0, 3.0)})
    assert servo.values['effects.te.cosine'] == (0.01, 0.0, 0.0)


@settings(max_examples=200, deadline=None)
@given(speed=st.floats(-10.0, 10.0), push=st.floats(-50.0, 50.0), budget=st.floats(0.0, 100.0),
       inertia=st.floats(1e-4, 10.0), h=st.floats(1e-6, 1e-2))
def test_friction_takes_from_a_shaft_and_never_gives(speed, push, budget, inertia, h):
    x = np.array([0.0, speed, 1.0, 0.0])
    free = speed + h * push / inertia
    resisted = slide(x, 0, 2, push, budget, inertia, h)
    assert abs(x[1]) <= abs(free) * (1.0 + 1e-12)  # the order of the products rounds differently
    assert x[1] * free >= 0.0
    assert abs(resisted) <= budget * (1.0 + 1e-9) + 1e-9 * inertia * abs(free) / h
