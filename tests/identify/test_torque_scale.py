"""How sure a torque can be where none is measured."""

from dataclasses import replace

import numpy as np
import pytest

from servo_identify.diagnose.handover.added import Added, servo_with
from servo_identify.diagnose.handover.certainty import held_spread, torque_scale
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.recording.recording import COLUMNS, Recording

ARM = servo_file.loads("""
servo: arm
step: 1.0e-4
drive: {type: voltage, resistance: 1.0, inductance: 0.0, back_emf: 0.1, torque_constant: 0.1}
mechanism: {type: rigid, rotor_inertia: 0.0, load_inertia: 0.2, ratio: 10.0}
effects:
  rubs: {effect: coulomb_friction, at: load, level: 0.5}
tolerance: {drive.torque_constant: 4 %, mechanism.load_inertia: 6 %, drive.back_emf: 1 %}
""")


def recording(**columns):
    return Recording('swing', 1e-3, {name: np.full(10, np.nan) for name in COLUMNS} | {
        name: np.full(10, value) for name, value in columns.items()})


@pytest.mark.parametrize('measured', [{}, {'external_torque': 0.0}])
def test_the_tolerances_alone_tell_the_factor_of_all_torques(measured):
    # a tolerance is two standard deviations: 2 % and 3 % together
    assert torque_scale(ARM, [recording(**measured)]) == pytest.approx(
        (0.02**-2 + 0.03**-2)**-0.5, rel=1e-6)


@pytest.mark.parametrize('measured', [{'torque': 1.0}, {'external_torque': 0.3}])
def test_a_measured_torque_tells_it(measured):
    assert torque_scale(ARM, [recording(**measured)]) == 0.0


def test_a_sensor_whose_gain_is_asked_for_tells_it_not():
    """A sensor that reads 6 % too much looks like torques that are 6 % larger."""
    name, excess = 'torque_sensor_gain', 'effects.torque_sensor_gain.excess'
    gain = Added(None, (Placed(name, find(name), 'torque'),), {excess: 0.06}, (excess,),
                 held=frozenset({excess}), stds={excess: 4e-4})
    scale = torque_scale(ARM, [recording(torque=1.0)], [gain])
    assert scale == pytest.approx((0.02**-2 + 0.03**-2)**-0.5, rel=1e-6)
    there = servo_with(ARM, [gain])
    assert held_spread([gain], there, scale)[excess] == pytest.approx(1.06 * scale)
    assert held_spread([gain], there, 0.0)[excess] == 4e-4


def test_an_exact_torque_constant_tells_it():
    exact = replace(ARM, tolerance={'mechanism.load_inertia': (0.19, 0.21)})
    assert torque_scale(exact, [recording()]) == 0.0
