"""Curves over the angle of an axis that turns through a part of a turn, or slides."""

import numpy as np
import pytest

from servo_identify.diagnose.handover.curves import Curve, Part
from servo_identify.diagnose.handover.laws import formed
from servo_identify.diagnose.mechanisms.hypothesis import Mechanism
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find

VALVE = servo_file.loads("""
servo: valve
step: 1.0e-3
drive: {type: current, gain: 1.0, torque_constant: 0.1}
mechanism: {type: rigid, rotor_inertia: 1.0e-5, load_inertia: 0.02, ratio: 100.0}
sensors: {motor_encoder: {noise: 1.0e-3}}
""")


def handed_over(low, high, resists):
    """Return the effect, and what it resists with at some angles, of friction over an angle."""
    x = np.linspace(low, high, 41)
    curve = Curve('angle', 'rad', 'N m', x, resists(x), resists(x) - 0.01, resists(x) + 0.01,
                  np.ones(41))
    part = Part(0, Mechanism('position_dependent_friction', 'friction', 'load', ('angle',), 'odd'),
                curve, np.ones(8))
    one = formed(part, VALVE)
    law = find('friction_over_angle').law
    values = type('Values', (), one.values)

    def at(angle):
        return law(values, [], type('Shaft', (), {'angle': float(angle)}), 0.0)

    return one, at


def seat(angle):
    return 40.0 * np.maximum(np.abs(angle) - 0.4, 0.0) ** 2


def test_a_part_of_a_turn_is_followed_to_its_ends_and_stays_beyond():
    one, at = handed_over(-0.75, 0.75, seat)
    assert one.effect.name == 'friction_over_angle'
    for angle in (-0.74, -0.3, 0.0, 0.6, 0.75):
        assert at(angle) == pytest.approx(seat(angle), abs=0.25)
    assert at(2.0) == pytest.approx(at(0.75)) and at(-2.0) == pytest.approx(at(-0.75))


def test_a_whole_turn_repeats():
    one, at = handed_over(0.0, 2.0 * np.pi, lambda x: 1.0 + 0.5 * np.abs(np.sin(0.5 * x)))
    assert at(0.3) == pytest.approx(at(0.3 + 2.0 * np.pi))
    assert at(3.0) == pytest.approx(1.5, abs=0.1)
