"""What a candidate would move: at the size it has, and between the shapes that are tried."""

from dataclasses import replace

import numpy as np
import pytest
from screened import BENCH, chosen_of, extended, screened, stacked
from synthetic import PERIOD, sampled

from servo_identify.gap.candidates import candidates_of
from servo_identify.gap.explanation import fit
from servo_identify.gap.gains_off import gains_off
from servo_identify.gap.shape_values import shape_values
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find, names
from servo_twin.physics.servo import Placed

TIME = np.arange(int(8.0 / PERIOD)) * PERIOD
JOINT = """
servo: joint
step: 1.0e-3
drive: {type: current, gain: 1.0, torque_constant: 0.11}
mechanism: {type: rigid, rotor_inertia: 2.0e-4, load_inertia: 0.6, ratio: 30.0}
controller: {type: position_loop, kp: 20.0, kv: 0.3, ki: 1.5, kd: 1.0, limit: 8.0}
sensors:
  motor_encoder: {noise: {value: 1.0e-4, unit: rad}}
  load_encoder: {noise: {value: 2.0e-6, unit: rad}}
  current_sensor: {noise: {value: 0.005, unit: A}}
effects:
  bearing: {effect: coulomb_friction, at: load, level: 1.5}
"""


def test_gains_that_multiply_each_other_are_seen_at_their_joint_size():
    servo = servo_file.loads(JOINT)
    recording = sampled(servo, 2.0 * np.sin(2.0 * np.pi * 0.7 * TIME), seed=1)
    wanted = 0.01 * np.sin(2.0 * np.pi * 0.7 * TIME)
    recording = replace(recording, columns={**recording.columns,
                                            'reference_position': 0.3 + wanted})
    stack = stacked([recording], extended(servo, 'coulomb_friction'))
    mismatch = next(c for c in candidates_of(stack.extended, shape_values(stack, stack.base))
                    if c.name == 'controller_mismatch')
    amplitudes = np.array([0.16 * servo.values[path] for path in mismatch.paths])
    amplitudes[amplitudes == 0.0] = 0.01
    theta = stack.extended.theta.copy()
    for path, amplitude in zip(mismatch.paths, amplitudes, strict=True):
        theta[stack.extended.slot(path)] += amplitude
    moved = stack.at(theta, stack.extended.on) - stack.base
    assert np.sqrt(np.mean(moved**2)) > 1.0
    np.testing.assert_allclose(stack.columns(mismatch, amplitudes) @ amplitudes, moved,
                               atol=1e-9 * np.abs(moved).max())


def test_gains_are_found_however_far_they_are_off():
    servo = servo_file.loads(JOINT)
    far = {'controller.kp': 28.0, 'controller.kv': 0.24, 'controller.ki': 0.6}
    recording = sampled(servo, 2.0 * np.sin(2.0 * np.pi * 0.7 * TIME), seed=1)
    wanted = recording['load_position'] + 0.02 * np.sin(2.0 * np.pi * 0.6 * TIME)
    recording = replace(recording, columns={**recording.columns, 'reference_position': wanted})
    one = stacked([recording], extended(servo, 'coulomb_friction')).balances[0]
    theta = one.servo.theta
    for path, value in far.items():
        theta[one.slots[path]] = value
    made = one.command_of(theta, one.base_switches, one.seen.channels)
    recording = replace(recording, columns={**recording.columns, 'voltage': made})
    stack = stacked([recording], extended(servo, 'coulomb_friction'))
    off = gains_off(stack, tuple(far))
    for (path, value), change in zip(far.items(), off, strict=True):
        assert servo.values[path] + change == pytest.approx(value, rel=0.02)


@pytest.mark.parametrize('frequency', (7.3, 9.1))
def test_a_resonance_is_found_wherever_it_lies_between_the_tried_frequencies(frequency):
    rig = BENCH.with_effects(Placed('p', find('payload_resonance'), 'load'), values={
        'effects.p.inertia': 0.6, 'effects.p.frequency': frequency, 'effects.p.damping': 0.015})
    swept = 1.5 * np.sin(2.0 * np.pi * (1.0 + 0.9 * TIME) * TIME)
    chirps = [replace(sampled(rig, swept, seed=seed), family='chirp') for seed in (1, 2)]
    screening = screened(chirps, BENCH, 'payload_resonance', 'gravity')
    chosen = chosen_of(screening)
    found = screening.library.candidates[chosen[0]]
    assert found.name == 'payload_resonance'
    theta = fit(screening, chosen[:1]).theta
    path = next(p for p, _ in found.shapes if p.endswith('frequency'))
    assert theta[screening.stack.extended.slot(path)] == pytest.approx(frequency, rel=0.01)


def test_every_cause_of_the_catalogue_can_be_fitted_from_where_it_was_tried():
    recording = sampled(BENCH, 2.0 * np.sin(2.0 * np.pi * 0.7 * TIME), seed=1)
    screening = screened([recording], BENCH, *names())
    known = screening.library.candidates
    firsts = {one.key: number for number, one in reversed(list(enumerate(known)))}
    assert len(firsts) > 40
    for number in firsts.values():
        found = fit(screening, [number])
        for path, value in known[number].shapes:
            if not screening.stack.extended.declaration(path).grid:
                assert found.theta[screening.stack.extended.slot(path)] == value, path
        for one in found.unknowns:
            value = found.theta[screening.stack.extended.slot(one.path, one.element)]
            assert one.low <= value <= one.high, one
